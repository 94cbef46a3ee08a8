"""Runs the tests that use threads, sockets or processes many times over: what fails once in fifty is a race.

    python tools/repeat.py                                # those below tests/, 50 times each
    python tools/repeat.py tests/sitl --times 200
    nice -n 10 python tools/repeat.py tests/crazyflie/connection/test_log_blocks.py -k refuses

It takes as long as the tests, times the repetitions. Best on a machine that is busy with other work. Each test is
repeated before the next one begins; fixtures of a module or of the session are made once. Prints for each test how
often it passed and failed; what the failures printed is kept in --out. Exit code 1 when anything failed.
"""

import argparse
import os
import re
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]  #: of the checkout
#: words of a test file that uses threads, sockets or processes
CONCURRENT = re.compile(r"\b(threading|socket|Popen|multiprocessing|dask|simulated_link|sitl|cflib)\b")
OUTCOMES = ("passed", "skipped", "failed")  #: of a stage of a test, the worst last
PRINTED = ("passed", "failed", "skipped")  #: the same, in the order of a line


class Repeat:
    """A pytest plugin: every test so many times, counted, failures kept in a folder."""

    def __init__(self, times: int, folder: Path) -> None:
        self.times, self.folder = times, folder
        self.counts: dict[str, Counter[str]] = {}  #: test -> outcome -> repetitions
        self.started: dict[str, float] = {}
        self._worst: dict[str, str] = {}  #: repetition that runs -> outcome of its stages so far

    @pytest.fixture
    def repeated(self) -> None:
        """Asked for by every test, with the number of the repetition."""

    def pytest_generate_tests(self, metafunc: pytest.Metafunc) -> None:
        """Repeat every test `times` times."""
        metafunc.fixturenames.append("repeated")
        names = [f"again{i}" for i in range(self.times)]
        metafunc.parametrize("repeated", range(self.times), indirect=True, ids=names)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Count the outcome of each repetition, whose set-up, call and teardown are reported one by one."""
        name = re.sub(r"again\d+-|-?again\d+", "", report.nodeid).replace("[]", "")
        self.started.setdefault(name, time.monotonic() - report.duration)
        self._worst[report.nodeid] = max(report.outcome, self._worst.get(report.nodeid, "passed"), key=OUTCOMES.index)
        if report.failed:
            self._keep(report)
        if report.when == "teardown":
            counts = self.counts.setdefault(name, Counter())
            counts[self._worst.pop(report.nodeid)] += 1
            if counts.total() == self.times:
                print(" ".join(f"{counts[outcome]:4} {outcome}" for outcome in PRINTED)
                      + f" {time.monotonic() - self.started[name]:7.1f} s  {name}", flush=True)

    def total(self, outcome: str) -> int:
        """Repetitions of all tests with this outcome."""
        return sum(counts[outcome] for counts in self.counts.values())

    def _keep(self, report: pytest.TestReport) -> None:
        """Write what a failure printed to a file of the folder."""
        path = self.folder / f"{re.sub(r'[^A-Za-z0-9]+', '_', report.nodeid)[-150:]}_{report.when}.txt"
        path.write_text(f"{report.nodeid}, {report.when}\n{report.longreprtext}\n"
                        + "\n".join(f"--- {title}\n{text}" for title, text in report.sections))
        print(f"FAILED {report.nodeid}, {report.when}: {os.path.relpath(path)}", flush=True)


def concurrent_tests() -> list[str]:
    """The test files that use threads, sockets or processes, and those of the link."""
    return [str(path) for path in sorted((ROOT / "tests").rglob("test_*.py"))
            if CONCURRENT.search(path.read_text()) or "link" in path.name]


def main() -> int:
    """Run the tests many times and print how often each failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tests", nargs="*", help="files or folders; by default those of threads, sockets, processes")
    parser.add_argument("--times", type=int, default=50, help="repetitions of each test (50)")
    parser.add_argument("-k", default="", help="only tests that match, as pytest's -k")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "repeat",
                        help="folder of what failures print (build/repeat)")
    args = parser.parse_args()
    if args.times < 1:
        parser.error("--times must be at least 1")
    if missing := [test for test in args.tests if not Path(test.split("::")[0]).exists()]:
        parser.error(f"no such file or folder: {', '.join(missing)}")
    args.out.mkdir(parents=True, exist_ok=True)
    plugin = Repeat(args.times, args.out)
    quiet = ["-p", "no:terminal", "-o", "addopts=--strict-markers --import-mode=importlib", "-p", "no:cacheprovider"]
    options = [*quiet, *(["-k", args.k] if args.k else [])]
    code = pytest.main([*options, *(args.tests or concurrent_tests())], plugins=[plugin])
    print(f"{len(plugin.counts)} tests: " + ", ".join(f"{plugin.total(o)} {o}" for o in PRINTED))
    return int(code != pytest.ExitCode.OK)


if __name__ == "__main__":
    sys.exit(main())
