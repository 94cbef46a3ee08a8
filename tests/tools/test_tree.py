"""The top folder holds what a reader expects there, and nothing that a run left behind."""

import re
import shutil
import subprocess
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: what may stand in the top folder; anything else belongs into one of its folders or was left by a run
ALLOWED = (".*", "CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "Makefile", "README.md",
           "pyproject.toml", "*.lock", "firmware", "gap8", "host", "tests", "tools")


def strangers(root: Path) -> set[str]:
    """The names in the top folder that git tracks and ALLOWED does not list."""
    tracked = subprocess.run(["git", "ls-files"], cwd=root, capture_output=True, text=True, check=True).stdout
    names = {line.split("/")[0] for line in tracked.splitlines()}
    return {name for name in names if not any(fnmatch(name, pattern) for pattern in ALLOWED)}


@pytest.mark.skipif(shutil.which("git") is None or not (ROOT / ".git").exists(),
                    reason="no git checkout on this machine")
def test_the_top_folder_holds_only_what_it_may():
    assert strangers(ROOT) == set()


@pytest.mark.skipif(shutil.which("git") is None, reason="no git on this machine")
def test_a_file_that_a_run_left_is_seen(tmp_path):
    subprocess.run(["git", "init", "-q", tmp_path], check=True)
    (tmp_path / "README.md").touch()
    (tmp_path / "crash-1-0").touch()
    subprocess.run(["git", "add", "."], cwd=tmp_path, check=True)
    assert strangers(tmp_path) == {"crash-1-0"}


OWN = {"fuzz"}  #: folders of tests that mirror none: the fuzz targets of all C


def test_a_folder_of_tests_is_named_as_the_folder_that_it_tests():
    tests = ROOT / "tests"
    folders = {path.parent.relative_to(tests).as_posix() for path in tests.rglob("test_*.py")} - {"."}
    assert {f for f in folders if not any((base / f).is_dir() for base in (ROOT, ROOT / "host/airtouch"))} == OWN


def test_no_folder_of_tests_holds_more_than_a_reader_overlooks():
    folders = {path.parent for path in (ROOT / "tests").rglob("test_*.py")}
    assert {str(f.relative_to(ROOT)): n for f in folders if (n := len(list(f.glob("test_*.py")))) > 15} == {}


def test_every_script_and_every_package_is_in_the_list_of_tools():
    tools = ROOT / "tools"
    packages = {p.parent for p in tools.rglob("__init__.py") if not (p.parents[1] / "__init__.py").exists()}
    there = {p.name for p in packages} | {p.name for p in tools.rglob("*.py") if not packages & set(p.parents)}
    listed = set(re.findall(r"`(?:\w+/)?([\w.-]+)`", (tools / "README.md").read_text("utf-8")))
    assert there - listed == set()


def test_the_top_of_tools_holds_what_make_runs_and_what_is_called_by_path():
    run = set(re.findall(r"tools/(\w+\.py)", (ROOT / "Makefile").read_text("utf-8")))
    assert {path.name for path in (ROOT / "tools").glob("*.py")} == run | {"gap_real.py"}


def test_no_folder_of_tools_holds_more_than_a_reader_overlooks():
    folders = [path for path in [ROOT / "tools", *(ROOT / "tools").glob("*/")] if path.name != "__pycache__"]
    assert len(folders) > 8 and {f.name: n for f in folders if (n := len(list(f.glob("*.py")))) > 14} == {}
