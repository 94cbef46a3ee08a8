"""Prints the seconds that `airtouch gap diagnose` takes for a packaged flight of 25 s and four baseline flights.

    python tools/benchmarks/bench_diagnosis.py [--runs 5]    # a minute a run

JSON and report are written too. Each run is a process of its own, on all processors and on one in turn, after one
warm-up that compiles: with the first flight against a baseline, and with a further one, for which the baseline's
scatter is kept. Nothing else should run beside it. host/docs/gap-real.md has the times.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from importlib import resources
from pathlib import Path

from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.progress import with_bar
from airtouch.errors import AirTouchError, in_one_line
from airtouch.gap.nominal.kept_scatter import VARIABLE

#: environment in which Python keeps what it compiles of its modules, as it does where nothing forbids it
KEEPS_BYTECODE = {"PYTHONDONTWRITEBYTECODE": ""}


def seconds(processors: set[int], out: Path, cache: str) -> float:
    """Wall time of one diagnosis on some processors; cache: folder of the baselines' scatters, empty for none."""
    example = resources.files("airtouch.gap.example")
    baseline = [str(example / f"nominal_{i}.csv.gz") for i in range(4)]
    command = [sys.executable, "-m", "airtouch", "gap", "diagnose", str(example / "real.csv.gz"),
               "--baseline", *baseline, "--json", str(out / "it.json"),
               "--report", str(out / "it.html"), "--force"]
    start = time.perf_counter()
    run = subprocess.run(command, capture_output=True, text=True, env={**os.environ, VARIABLE: cache, **KEEPS_BYTECODE},
                         preexec_fn=lambda: os.sched_setaffinity(0, processors))
    if run.returncode:
        raise AirTouchError(f"the diagnosis failed: {(run.stderr.strip().splitlines() or ['without a message'])[-1]}")
    return time.perf_counter() - start


def main() -> None:
    """Time it and print medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=whole_number(1), default=5, help="of each kind (default %(default)s)")
    runs = parser.parse_args().runs
    free = os.sched_getaffinity(0)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        cache_folder = str(out / "cache")
        rows = {f"{flight} flight, {name}": (processors, cache)
                for flight, cache in (("first", ""), ("further", cache_folder))
                for name, processors in ((f"{len(free)} processors", free), ("1 processor", {min(free)}))}
        print("warming up: the first time compiles", file=sys.stderr, flush=True)
        seconds(free, out, cache_folder)
        rounds = [{row: seconds(processors, out, cache) for row, (processors, cache) in rows.items()}
                  for _ in with_bar(range(runs), "runs")]
    for row in rows:
        column = [times[row] for times in rounds]
        print(f"{row}: {statistics.median(column):.1f} s, {min(column):.1f} to {max(column):.1f} s in {runs} runs")


if __name__ == "__main__":
    with in_one_line("bench_diagnosis"):
        main()
