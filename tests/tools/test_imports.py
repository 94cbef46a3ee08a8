"""The one rule by which files of tools import each other: tools/README.md."""

import ast
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[2] / "tools"
PACKAGE = "__init__.py"


def faults(path: Path, tools: Path) -> list[str]:
    """What a file of the folder `tools` imports against the rule, or does to sys.path."""
    own = {"tools", *(p.stem for p in tools.rglob("*") if p.is_dir() or p.suffix == ".py")}
    in_package = (path.parent / PACKAGE).exists()
    out = []
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        names = []
        if isinstance(node, ast.Attribute) and ast.unparse(node) == "sys.path":
            out.append("sys.path")
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not in_package:
            out.append("a relative import in a script")
        for parts in (name.split(".") for name in names):
            folders = (path.parent.joinpath(*parts[:n]) for n in range(1, len(parts) + 1))
            if parts[0] in own and (in_package or not any((folder / PACKAGE).exists() for folder in folders)):
                out.append(".".join(parts))
    return out


def test_scripts_import_packages_beside_them_and_packages_import_relatively():
    assert {str(p.relative_to(TOOLS)): f for p in TOOLS.rglob("*.py") if (f := faults(p, TOOLS))} == {}


@pytest.mark.parametrize(("path", "text", "fault"), [
    ("script.py", "import sys\nsys.path.insert(0, '.')", "sys.path"),
    ("script.py", "from other import x", "other.x"),
    ("script.py", "from folder.third import x", "folder.third.x"),
    ("script.py", "from tools.folder.package import x", "tools.folder.package.x"),
    ("script.py", "from .folder import x", "a relative import in a script"),
    ("folder/package/module.py", "import sibling", "sibling"),
    ("folder/package/module.py", "from tools.folder.package import sibling", "tools.folder.package.sibling"),
    ("script.py", "from folder.package.sibling import x", None),
    ("script.py", "from folder import package", None),
    ("folder/third.py", "from package import sibling", None),
    ("folder/package/module.py", "from .sibling import x", None)])
def test_a_fault_is_seen_and_nothing_else(tmp_path, path, text, fault):
    (tmp_path / "folder/package").mkdir(parents=True)
    for file in ("script.py", "other.py", "folder/third.py", "folder/package/__init__.py",
                 "folder/package/module.py", "folder/package/sibling.py"):
        (tmp_path / file).touch()
    (tmp_path / path).write_text(text)
    assert faults(tmp_path / path, tmp_path) == ([fault] if fault else [])
