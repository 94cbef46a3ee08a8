"""The page of decisions names every module of the diagnosis, no folder imports one above it, and tests mirror them."""

import ast
import re
from pathlib import Path

from airtouch import gap

ROOM = Path(gap.__file__).parent
PAGE = ROOM.parents[1] / "docs" / "architecture.md"
#: folders from the lowest up: the package's own words name them in the other order, a line each
FOLDERS = [name for name in re.findall(r"^(\w+)  +\S", gap.__doc__, re.M) if (ROOM / name).is_dir()][::-1]
#: Modules that stand beside the folders, and the lowest folder that may import them, None for any
BESIDE = {"workspace": None, "second_process": None, "result": None, "study": "evidence", "measurement": "sealed",
          "diagnosis": "sealed"}


def test_every_module_is_on_the_page_and_what_is_on_the_page_is_there():
    there = {path.relative_to(ROOM).as_posix() for path in ROOM.rglob("*.py")
             if path.name != "__init__.py" and path.parent.name != "example"}
    told = set(re.findall(r"`gap/([\w/]+\.py)`", PAGE.read_text()))
    assert {name for name in told if not name.endswith("__init__.py")} == there


def test_every_folder_and_the_modules_beside_them_are_told():
    assert sorted(FOLDERS) == sorted(f.parent.name for f in ROOM.glob("*/__init__.py") if f.parent.name != "example")
    assert {path.stem for path in ROOM.glob("*.py")} - {"__init__"} == set(BESIDE)
    assert all(f"`{name}`" in gap.__doc__ for name in BESIDE)


def test_tests_stand_in_the_folders_that_they_test():
    """Those of one folder in the folder of that name; those of several beside the folders."""
    here = Path(__file__).parent
    assert {path.parent.name for path in here.glob("*/test_*.py")} <= set(FOLDERS)


def test_a_folder_imports_only_those_below_it():
    upwards = []
    for path in ROOM.glob("*/**/*.py"):
        here = path.relative_to(ROOM).parts[0]
        if here == "example":
            continue
        for name in _imported(path):
            if name in FOLDERS and FOLDERS.index(name) > FOLDERS.index(here):
                upwards.append(f"{here}/{path.name} imports {name}")
            if BESIDE.get(name) and FOLDERS.index(here) < FOLDERS.index(BESIDE[name]):
                upwards.append(f"{here}/{path.name} imports {name}")
    assert not upwards


def _imported(path):
    """Names under `airtouch.gap` that a file imports when it runs, the first part of each."""
    names, tree = set(), ast.parse(path.read_text())
    for_types = [node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"]
    not_run = {id(node) for block in for_types for node in ast.walk(block)}
    for node in (node for node in ast.walk(tree) if id(node) not in not_run):
        if isinstance(node, ast.ImportFrom) and node.module == "airtouch.gap":
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("airtouch.gap."):
            names.add(node.module.split(".")[2])
    return names
