"""Prints how well a classifier tells one day's flights from another day's of the same drone: the yardstick of a twin.

    python tools/calibration/days_apart.py ../shared/flights/airtouch [--fewest 7]    # 40 s a row

The classifier is that of `airtouch twin`. Prints a Markdown table: each day with --fewest flights or more against each
other one, and, for comparison, two random halves of all flights, which differ in nothing; AUROC of each phase by
flight, with its 95 % interval. A twin that is fitted to flights of several days cannot be closer to each of them than
they are to each other. The table is in host/docs/twin-findings.md.
"""

import argparse
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from airtouch.cli.shared.arguments import whole_number
from airtouch.detector import best
from airtouch.detector.evaluation import crossval
from airtouch.detector.evaluation.data import dataset
from airtouch.errors import AirTouchError, in_one_line
from airtouch.twin.comparison.two_sample import MIN_FLIGHTS, two_sample, windows
from airtouch.twin.recorded.channels import channels
from airtouch.twin.recorded.course import PHASES, Course, course

SPEED_MPS = 0.3  #: m/s, of flights whose manifest states none: what most of the authors' flew at
#: channels (n, 12), course and number of a flight
FlightData = tuple[np.ndarray, Course, int]


def read_days(folders: Sequence[Path]) -> dict[str, list[FlightData]]:
    """Day -> (channels, course, number) of each of its flights that has a course."""
    listed = dataset.collect(folders, None)
    readable, _ = crossval.readable_flights(listed, best.SPARE_SENSORS)
    days: dict[str, list[FlightData]] = {}
    for number, file in enumerate(f for f in listed if f.path in readable):
        log = readable[file.path]
        try:
            path = course(log, file.condition.speed_mps or SPEED_MPS)
        except AirTouchError:
            continue
        days.setdefault(str(file.condition.day), []).append((channels(log), path, number))
    return days


def line(title: str, one: Sequence[FlightData], other: Sequence[FlightData]) -> str:
    """A row of the table."""
    aurocs = {a.phase: f"{a.value:.2f} ({a.low:.2f} to {a.high:.2f})" for a in two_sample(windows(one), windows(other))}
    return f"| {title} | {len(one)} / {len(other)} | {' | '.join(aurocs.get(p, '-') for p in PHASES)} |"


def main() -> None:
    """One line for each pair of days."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", help="of recorded flights of one drone")
    parser.add_argument("--fewest", type=whole_number(1), default=MIN_FLIGHTS,
                        help="flights of a day (default %(default)s)")
    options = parser.parse_args()
    days = read_days(options.folders)
    large = {day: flights for day, flights in sorted(days.items()) if len(flights) >= options.fewest}
    if len(large) < 2:
        raise AirTouchError(f"two days with {options.fewest} flights or more are needed, see --fewest; here: " +
                            (", ".join(f"{day} {len(flights)}" for day, flights in sorted(days.items())) or "none"))
    print(f"| | flights | {' | '.join(PHASES)} |\n|---|---|{'---|' * len(PHASES)}", flush=True)
    pooled = [flight for flights in days.values() for flight in flights]
    order = np.random.default_rng(0).permutation(len(pooled))
    half = len(pooled) // 2
    print(line("two random halves", [pooled[i] for i in order[:half]], [pooled[i] for i in order[half:]]), flush=True)
    for a, b in combinations(large, 2):
        print(line(f"{a} against {b}", large[a], large[b]), flush=True)


if __name__ == "__main__":
    with in_one_line("days_apart"):
        main()
