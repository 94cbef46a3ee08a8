"""The diagnosis on recorded flights, each row of the table in host/docs/gap-real.md.

    python tools/gap_real.py [FLIGHTS] [--part build|view|all] [--rows authors swarm] [--jobs 2] [--keep cases.jsonl]

build: the authors' folds 0 to 2 and neural-swarm's days 19 and 20, on which settings may be chosen; view: the rest, of
which each look is a line of host/docs/looks.md. Each flight is diagnosed alone: the authors' against five others of the
same day and condition, neural-swarm's against the nominal flights of the same drone and day. Labels are read afterwards.
"""

import argparse
import csv
import json
import os
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.gap.diagnose import diagnose
from airtouch.logs import read

OTHERS = 5  #: of the authors' flights, that one is held against
PER_GROUP = 4  #: flights tested of a day and condition
BUILD_FOLDS, BUILD_DAYS = ("0", "1", "2"), ("19", "20")


@dataclass(frozen=True)
class Case:
    """One flight to be diagnosed."""

    row: str
    truth: str
    vehicle: str
    flight: str
    baseline: tuple[str, ...]


def authors(folder: Path, part: str) -> Iterator[Case]:
    """Nominal flights of the authors against five others of the same day and condition."""
    made = defaultdict(list)
    for r in csv.DictReader((folder / "airtouch" / "manifest.csv").open()):
        if r["use"] == "clean" and r["wind"] == "none" and _wanted(part, r["fold"] in BUILD_FOLDS):
            made[r["file"].split("_")[2][:4], r["height"], r["angle_deg"]].append(str(folder / "airtouch" / r["file"]))
    for (day, height, angle), files in made.items():
        if len(files) <= OTHERS:
            continue
        step = max(len(files) // PER_GROUP, 1)
        for flight in files[::step][:PER_GROUP]:
            others = [f for f in files if f != flight][:OTHERS]
            yield Case("authors' nominal flights", "none", "crazyflie-2.1-flow", flight, tuple(others))


def swarm(folder: Path, part: str) -> Iterator[Case]:
    """Neural-swarm's flights with ground effect, under another's wake, and neither."""
    own = folder / "neuralswarm"
    base = defaultdict(list)
    for r in csv.DictReader((own / "baselines.csv").open()):
        base[r["group"]].append(str(own / "flights" / r["file"]))
    for r in csv.DictReader((own / "manifest.csv").open()):
        if _wanted(part, r["day"] in BUILD_DAYS):
            yield Case(f"neural-swarm, {r['vehicle']}", r["truth"], str(own / f"{r['vehicle']}.toml"),
                       str(own / "flights" / r["file"]), tuple(base[r["group"]]))


def _wanted(part: str, build: bool) -> bool:
    return part == "all" or build == (part == "build")


ROWS = {"authors": authors, "swarm": swarm}


def answered(case: Case) -> dict:
    """A case with its diagnosis."""
    started = time.perf_counter()
    out = {**asdict(case), "flight": Path(case.flight).name, "baseline": len(case.baseline)}
    try:
        told = diagnose([read(case.flight)], vehicles.load(case.vehicle), [read(b) for b in case.baseline])
    except AirTouchError as error:
        return {**out, "verdict": "refused", "names": [], "why": str(error)}
    return {**out, "verdict": told.verdict, "names": [e.name for e in told.effects],
            "strengths": {e.name: {k: q.value for k, q in e.parameters.items()} for e in told.effects},
            "gap": told.gap["before"], "after": told.gap["after"],
            "ranking": {r.name: round(r.probability, 4) for r in told.ranking[:6]},
            "seconds": time.perf_counter() - started}


def answer(case: dict) -> str:
    """The first name of a diagnosis, or its verdict."""
    return case["names"][0] if case["verdict"] == "effect" else case["verdict"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flights", nargs="?", type=Path,
                        default=Path(os.environ.get("AIRTOUCH_FLIGHTS", "../shared/flights")))
    parser.add_argument("--part", choices=("build", "view", "all"), default="build")
    parser.add_argument("--rows", nargs="+", choices=sorted(ROWS), default=sorted(ROWS))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", type=Path, help="JSON lines; cases that it holds are not diagnosed again")
    args = parser.parse_args()
    cases = [c for row in args.rows for c in ROWS[row](args.flights, args.part)]
    done = {}
    if args.keep and args.keep.exists():
        done = {c["flight"]: c for c in map(json.loads, args.keep.read_text().splitlines())}
    todo = [c for c in cases if Path(c.flight).name not in done]
    with ProcessPoolExecutor(max(args.jobs, 1)) as pool:
        for i, case in enumerate(pool.map(answered, todo)):
            done[case["flight"]] = case
            if args.keep:
                with args.keep.open("a") as out:
                    out.write(json.dumps(case) + "\n")
            print(f"{i + 1}/{len(todo)} {case['truth']}: {answer(case)} {case['flight']}", file=sys.stderr, flush=True)
    table = defaultdict(lambda: defaultdict(int))
    for c in cases:
        case = done[Path(c.flight).name]
        table[case["row"], case["truth"]][answer(case)] += 1
    for (row, truth), answers in sorted(table.items()):
        told = ", ".join(f"{name} {n}" for name, n in sorted(answers.items(), key=lambda x: -x[1]))
        print(f"{row} | {truth} | {answers[truth]} of {sum(answers.values())} right | {told}")


if __name__ == "__main__":
    main()
