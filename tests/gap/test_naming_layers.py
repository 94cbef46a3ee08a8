"""Within `naming` a module imports those only that its docstring tells below it."""

import ast
import re
from pathlib import Path

from airtouch.gap import naming

ROOM = Path(naming.__file__).parent
#: modules and folders, the highest first
LAYERS = re.findall(r"^(\w+)  +\S", naming.__doc__, re.M)


def test_every_module_has_a_layer():
    there = {path.stem for path in ROOM.glob("*.py")} | {path.parent.name for path in ROOM.glob("*/__init__.py")}
    assert sorted(LAYERS) == sorted(there - {"__init__"})


def test_a_module_imports_only_those_below_it():
    upwards = []
    for path in ROOM.glob("**/*.py"):
        layer = path.relative_to(ROOM).parts[0].removesuffix(".py")
        if layer != "__init__":
            upwards += [f"{layer} imports {name}" for name in imported(path)
                        if name != layer and LAYERS.index(name) <= LAYERS.index(layer)]
    assert not upwards


def imported(path):
    """Names under `airtouch.gap.naming` that a file imports, the first part of each."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module == "airtouch.gap.naming":
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("airtouch.gap.naming."):
            yield node.module.split(".")[3]
