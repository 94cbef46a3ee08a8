"""Prints the seconds that `airtouch gap diagnose` takes for one flight and its baseline flights.

    python tools/benchmarks/bench_diagnosis.py [NEURALSWARM] [--runs 5]    # two minutes a run, one without recordings

The packaged flight, a simulated one of 25 s with four baseline flights; where the data set of neural-swarm is, two
recorded ones of 20 s with three as well, with ground effect and below another vehicle. JSON and report are
written too. Each run is a process of its own, on all processors and on one in turn, after one warm-up that compiles:
with the first flight against a baseline, and with a further one, for which the baseline's scatter is kept. Nothing else
should run beside it. host/docs/gap-real.md has the times.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

from airtouch.cli.shared.arguments import whole_number
from airtouch.cli.shared.flights import data_folder
from airtouch.cli.shared.progress import with_bar
from airtouch.errors import AirTouchError, in_one_line
from airtouch.gap.nominal.kept_scatter import VARIABLE

#: environment in which Python keeps what it compiles of its modules, as it does where nothing forbids it
KEEPS_BYTECODE = {"PYTHONDONTWRITEBYTECODE": ""}
#: recorded flights by their names here: flight, vehicle and baseline flights in neural-swarm's folder
RECORDED = {
    "recorded ground effect": ("ground_effect_cf50d20_002", "ns-34g", "cal_cf50d20"),
    "recorded wake": ("downwash_cf50d20_052", "ns-34g", "cal_cf50d20"),
}


def packaged() -> list[str]:
    """Arguments for the packaged flight."""
    example = resources.files("airtouch.gap.example")
    return [str(example / "real.csv.gz"), "--baseline", *(str(example / f"nominal_{i}.csv.gz") for i in range(4))]


def recorded(folder: Path) -> dict[str, list[str]]:
    """Arguments for each of RECORDED; none where a file is absent."""
    out = {}
    for name, (flight, vehicle, baseline) in RECORDED.items():
        nominal = sorted((folder / "flights").glob(f"{baseline}_*.csv.gz"))
        files = folder / "flights" / f"{flight}.csv.gz", folder / f"{vehicle}.toml"
        if nominal and all(f.is_file() for f in files):
            out[name] = [str(files[0]), "--vehicle", str(files[1]), "--baseline", *map(str, nominal)]
    return out


def seconds(arguments: Sequence[str], processors: set[int], out: Path, cache: str) -> float:
    """Wall time of one diagnosis on some processors; cache: folder of the baselines' scatters, empty for none."""
    command = [sys.executable, "-m", "airtouch", "gap", "diagnose", *arguments, "--json", str(out / "it.json"),
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
    parser.add_argument("folder", nargs="?", type=Path, default=data_folder("neuralswarm"),
                        help="folder of the data set (default: neuralswarm in AIRTOUCH_FLIGHTS or ../shared/flights)")
    parser.add_argument("--runs", type=whole_number(1), default=5, help="of each kind (default %(default)s)")
    options = parser.parse_args()
    free = os.sched_getaffinity(0)
    flights = {"packaged flight": packaged(), **recorded(options.folder)}
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        rows = {f"{flight}, {which}, {name}": (arguments, processors, cache)
                for flight, arguments in flights.items()
                for which, cache in (("first", ""), ("further", str(out / "cache")))
                for name, processors in ((f"{len(free)} processors", free), ("1 processor", {min(free)}))}
        print("warming up: the first time compiles", file=sys.stderr, flush=True)
        for arguments in flights.values():
            seconds(arguments, free, out, str(out / "cache"))
        rounds = [{row: seconds(arguments, processors, out, cache)
                   for row, (arguments, processors, cache) in rows.items()}
                  for _ in with_bar(range(options.runs), "runs")]
    for row in rows:
        column = [times[row] for times in rounds]
        print(f"{row}: {statistics.median(column):.1f} s, {min(column):.1f} to {max(column):.1f} s "
              f"in {options.runs} runs")


if __name__ == "__main__":
    with in_one_line("bench_diagnosis"):
        main()
