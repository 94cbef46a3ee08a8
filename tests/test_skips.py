"""The guard of tests/skips.py: a skip for want of data fails where the recorded flights are."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

FILES = {
    "test_a.py": "import pytest\ndef test_file():\n    pytest.skip('some.csv is not there')\n"
                 "def test_tool():\n    pytest.skip('no C compiler on this machine')\n"
                 "@pytest.mark.skipif(True, reason='no traces')\ndef test_mark():\n    pass\n"
                 "@pytest.mark.xfail\ndef test_known():\n    assert False\n"
                 "def test_right():\n    pass\n",
    "test_b.py": "import pytest\npytest.skip('no flights', allow_module_level=True)\n",
    "test_c.py": "import pytest\npytest.importorskip('no_such_package')\n",
}


def outcomes(folder, **environment):
    """{passed, failed, skipped, error: count} of the files above, in a project with the guard; and what was printed."""
    tests = folder / "project" / "tests"
    support = tests / "support"
    support.mkdir(parents=True)
    shutil.copy(Path(__file__).parent / "support/skips.py", support)
    (tests / "conftest.py").write_text(
        "from skips import pytest_make_collect_report, pytest_runtest_makereport  # noqa: F401\n")
    for name, text in FILES.items():
        (tests / name).write_text(text)
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("AIRTOUCH", "PYTEST"))}
    process = subprocess.run([sys.executable, "-m", "pytest", "-p", "no:cacheprovider",
                              "--continue-on-collection-errors", "--rootdir", tests, tests],
                             capture_output=True, text=True, cwd=tests,
                             env=clean | {"PYTHONPATH": str(support)} | environment)
    counts = {name: int(n) for n, name in re.findall(r"(\d+) (passed|failed|skipped|error|xfailed)", process.stdout)}
    return counts, process.stdout


@pytest.mark.parametrize("place", ["../shared/flights", "AIRTOUCH_FLIGHTS"])
def test_with_flights_only_a_missing_tool_may_skip(tmp_path, place):
    flights = tmp_path / ("shared/flights" if place == "../shared/flights" else "elsewhere")
    flights.mkdir(parents=True)
    counts, text = outcomes(tmp_path, **({} if place == "../shared/flights" else {place: str(flights)}))
    assert counts == {"failed": 1, "error": 2, "passed": 1, "skipped": 2, "xfailed": 1}, text
    for reason in ("some.csv is not there", "no traces", "no flights"):
        assert re.search(rf"recorded flights are in {flights}, and yet: .*{reason}", text)


def test_without_flights_tests_skip(tmp_path):
    counts, text = outcomes(tmp_path)
    assert counts == {"passed": 1, "skipped": 5, "xfailed": 1}, text
