"""Docstrings and comments name what is there: each `module.name` in backticks can be imported."""

import ast
import importlib
import inspect
import io
import re
import tokenize
from pathlib import Path

import pytest

import airtouch

ROOT = Path(airtouch.__file__).parent
DOTTED = re.compile(r"`([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+)(?:\(\))?`")
FILES = {"csv", "h", "html", "json", "jsonl", "part", "py", "tex", "toml", "yaml"}
#: first parts that are no Python: groups of the firmware's log variables, and a struct of the kernels in C
NOT_PYTHON = {"acc", "flatNetworkInt8_t", "gyro", "stateEstimate", "stateEstimateZ", "supervisor"}
MODULES = {".".join(("airtouch", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__"): path
           for path in sorted(ROOT.rglob("*.py"))}

CLASSES: dict[str, list[str]] = {}  #: class -> modules that define it
for _module, _path in MODULES.items():
    for _node in ast.parse(_path.read_text()).body:
        if isinstance(_node, ast.ClassDef):
            CLASSES.setdefault(_node.name, []).append(_module)


def names_in(source: str) -> set[str]:
    """Dotted names in backticks in docstrings and comments of a module, but those that begin with an argument."""
    nodes = list(ast.walk(ast.parse(source)))
    arguments = {node.arg for node in nodes if isinstance(node, ast.arg)}
    texts = [ast.get_docstring(node) or "" for node in nodes
             if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef))]
    texts += [token.string for token in tokenize.generate_tokens(io.StringIO(source).readline)
              if token.type == tokenize.COMMENT]
    names = {name for text in texts for name in DOTTED.findall(text)}
    return {name for name in names
            if name.split(".")[-1] not in FILES and name.split(".")[0] not in NOT_PYTHON | arguments}


def is_there(name: str, module: str) -> bool:
    """Whether a name is known in a module, is a class's, or is known in a module whose path ends as it begins."""
    first, *rest = name.split(".")
    within = vars(importlib.import_module(module))
    if first in within and holds(within[first], rest):
        return True
    if first == "at":
        return holds(airtouch, rest)
    if any(holds(getattr(importlib.import_module(other), first, None), rest) for other in CLASSES.get(first, ())):
        return True
    parts = name.split(".")
    for cut in range(len(parts), 0, -1):
        path = ".".join(parts[:cut])
        for other in MODULES:
            if other == path or other.endswith(f".{path}"):
                if holds(importlib.import_module(other), parts[cut:]):
                    return True
    return first not in {m.split(".")[-1] for m in MODULES} and outside(parts)


def outside(parts: list[str]) -> bool:
    """Whether a name is one of another package."""
    try:
        return holds(importlib.import_module(".".join(parts[:-1])), parts[-1:])
    except ImportError:
        return False


def holds(thing: object, names: list[str]) -> bool:
    """Whether attributes, or fields of a class, lead from a thing along the names."""
    for name in names:
        if inspect.isclass(thing) and any(name in inspect.get_annotations(c) for c in thing.__mro__):
            return True
        try:
            thing = getattr(thing, name)
        except AttributeError:
            return False
    return True


@pytest.mark.parametrize("module", [m for m, path in MODULES.items() if names_in(path.read_text())])
def test_a_name_in_backticks_is_there(module):
    assert [n for n in sorted(names_in(MODULES[module].read_text())) if not is_there(n, module)] == []


def test_a_name_that_is_gone_is_noticed():
    names = names_in('"""As `best.detector.run`, `twin.gone.run`, `paper.detector.gone` and `manifest.csv`."""')
    assert sorted(n for n in names if not is_there(n, "airtouch.api")) == ["paper.detector.gone", "twin.gone.run"]
