"""`make repeat` on tests that pass, fail now and then, and fail when they end."""

import re
import subprocess
import sys
from pathlib import Path

TOOL = Path(__file__).parents[2] / "tools/repeat.py"
TESTS = """
import pytest

calls = []

def test_every_second_time():
    calls.append(1)
    assert len(calls) % 2

@pytest.fixture
def not_closed():
    yield
    assert False

@pytest.mark.parametrize("x", [1, 2])
def test_that_fails_in_its_teardown_too(not_closed, x):
    assert x == 1

def test_of_another_machine():
    pytest.skip("not here")
"""


def test_each_repetition_counts_once_and_each_failure_is_kept(tmp_path):
    (tmp_path / "test_it.py").write_text(TESTS)
    run = subprocess.run([sys.executable, TOOL, "test_it.py", "--times", "4", "--out", "kept"], cwd=tmp_path,
                         capture_output=True, text=True)
    assert run.returncode == 1, run.stderr
    lines = re.findall(r"(\d+) passed +(\d+) failed +(\d+) skipped .* s  \S+::test_(\S+)", run.stdout)
    assert lines == [("2", "2", "0", "every_second_time"), ("0", "4", "0", "that_fails_in_its_teardown_too[1]"),
                     ("0", "4", "0", "that_fails_in_its_teardown_too[2]"), ("0", "0", "4", "of_another_machine")]
    assert run.stdout.splitlines()[-1] == "4 tests: 2 passed, 10 failed, 4 skipped"
    kept = sorted(path.name for path in (tmp_path / "kept").iterdir())
    assert len([name for name in kept if name.endswith("_call.txt")]) == 2 + 4
    assert len([name for name in kept if name.endswith("_teardown.txt")]) == 4 + 4


def test_tests_that_all_pass_end_well(tmp_path):
    (tmp_path / "test_it.py").write_text("def test_sum():\n    assert 1 + 1 == 2\n")
    run = subprocess.run([sys.executable, TOOL, "test_it.py", "--times", "3", "--out", "kept"], cwd=tmp_path,
                         capture_output=True, text=True)
    assert run.returncode == 0 and run.stdout.splitlines()[-1] == "1 tests: 3 passed, 0 failed, 0 skipped"
    assert not list((tmp_path / "kept").iterdir())
