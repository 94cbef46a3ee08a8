"""Prints in how many flights `best` finds the same edges when it computes at the other half of the samples.

    python tools/detectors/half_of_best.py [FOLDER]    # 12 s

`best` computes at every second sample; in a log without its first sample it computes at the others. The app counts
samples from the moment that its battery was plugged in, so it may compute at either half. Also printed: the same count
where a flight's heading is turned by 90 degrees. Folds 0 to 2, clean flights; host/docs/results.md has the counts.
"""

import argparse
from pathlib import Path

import numpy as np

from airtouch import logs
from airtouch.cli.shared.flights import check_data_set, data_folder
from airtouch.cli.shared.progress import with_bar
from airtouch.detector import best
from airtouch.detector.evaluation.data.dataset import collect
from airtouch.detector.evaluation.data.folds import BUILD_FOLDS
from airtouch.errors import in_one_line
from airtouch.logs.flight_log import ACC_WORLD, FlightLog

CLOSE = 10  #: samples of 100 Hz within which an edge counts as the same; no source: round number


def without_first_sample(log: FlightLog) -> FlightLog:
    """The log without its first sample."""
    return FlightLog({name: values[1:] for name, values in log.columns.items()}, log.meta)


def turn(log: FlightLog) -> FlightLog:
    """The same flight at a heading of 90 degrees more, as a log of world axes would show it."""
    x, y, _ = ACC_WORLD
    return FlightLog({**log.columns, x: -log[y], y: log[x]}, log.meta)


def same(one: list, other: list, shift: int = 0) -> bool:
    """Whether two lists of edges have the same kinds in the same order, each within CLOSE samples."""
    return [e.kind for e in one] == [e.kind for e in other] and all(
        abs(a.sample - b.sample - shift) <= CLOSE for a, b in zip(one, other, strict=True))


def main() -> None:
    """Read, detect twice, and print how often the edges are the same."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, help="of the authors' flights (FLIGHTS/airtouch)",
                        default=data_folder("airtouch"))
    folder = parser.parse_args().folder
    check_data_set(folder)
    halves, headings = [], []
    for file in with_bar([f for f in collect([folder]) if f.condition.fold in BUILD_FOLDS], "flights"):
        log = logs.read(file.path)
        edges = best.run(log).edges
        halves.append(same(edges, best.run(without_first_sample(log)).edges, 1))
        if log.has(*ACC_WORLD):
            headings.append(same(edges, best.run(turn(log)).edges))
    for what, results in (("a log one sample shorter at its start", halves),
                          ("a heading of 90 degrees more", headings)):
        print(f"{what}: the same edges within {CLOSE / 100:.1f} s in {np.sum(results)} of {len(results)} flights")


if __name__ == "__main__":
    with in_one_line("half_of_best"):
        main()
