"""The map of the diagnosis names every module in its folder, no folder imports one below it, and tests mirror them."""

import ast
import re
from pathlib import Path

from airtouch import gap

ROOM = Path(gap.__file__).parent
#: The map's lines: what a folder holds, its name first
LINES = re.findall(r"^- `(\w+)`(.*?)(?=^- |\Z)", gap.__doc__.partition("Where each decision is made")[2], re.M | re.S)
FOLDERS = [name for name, _ in LINES if (ROOM / name).is_dir()]
#: Modules that stand beside the folders, and the first folder that may not import them
BESIDE = {"workspace": None, "second_process": None, "result": None, "measure": "answer", "diagnose": "sealed"}


def test_every_module_is_on_the_map_in_its_folder():
    listed = {name: set(re.findall(r"`(\w+)`", text)) - set(BESIDE) for name, text in LINES if name in FOLDERS}
    there = {folder.name: {path.stem for path in folder.glob("*.py")} - {"__init__"}
             for folder in ROOM.iterdir() if (folder / "__init__.py").exists() and folder.name != "example"}
    assert listed == there


def test_the_modules_beside_the_folders_are_on_the_map():
    assert {path.stem for path in ROOM.glob("*.py")} - {"__init__"} == set(BESIDE)
    assert all(f"`{name}`" in gap.__doc__ for name in BESIDE)


def test_tests_stand_in_the_folders_that_they_test():
    """Those of one folder in the folder of that name; those of several beside the folders."""
    here = Path(__file__).parent
    assert {path.parent.name for path in here.glob("*/test_*.py")} <= set(FOLDERS)


def test_a_folder_imports_only_those_above_it():
    upwards = []
    for path in ROOM.glob("*/*.py"):
        here = path.parent.name
        for name in _imported(path):
            if name in FOLDERS and FOLDERS.index(name) > FOLDERS.index(here):
                upwards.append(f"{here}/{path.name} imports {name}")
            if BESIDE.get(name) and FOLDERS.index(here) < FOLDERS.index(BESIDE[name]):
                upwards.append(f"{here}/{path.name} imports {name}")
    assert not upwards


def _imported(path):
    """Names under `airtouch.gap` that a file imports, the first part of each."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module == "airtouch.gap":
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("airtouch.gap."):
            names.add(node.module.split(".")[2])
    return names
