"""The diagnosis on recorded flights and on other people's simulators, each row of the table in host/docs/gap-real.md.

    python tools/gap_real.py [FLIGHTS] [--part build|view|all] [--rows authors swarm ...] [--jobs 2] [--keep x.jsonl]
    python tools/gap_real.py --quick    # a few flights of each row; fails where the diagnosis is broken

build: the flights on which settings may be chosen: the authors' folds 0 to 2, neural-swarm's days 19 and 20, three of
CrazyPAD's conditions in four. view: the rest, of which each look is a line of host/docs/looks.md, and the peers, on
which nothing is ever chosen. Each flight is diagnosed alone: the authors' against five others of the same day and
condition, neural-swarm's and CrazyPAD's against the nominal flights of the same drone. Labels are read afterwards.

    python tools/gap_real.py [FLIGHTS] --rows nominal    # false alarms on every nominal flight, 25 min

nominal: every nominal flight of a group against the others of it, the baseline flights of the other rows too. It runs
only where --rows names it.
"""

import argparse
import csv
import json
import multiprocessing
import os
import sys
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import swarm_cuts
from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.gap.diagnosis import diagnose
from airtouch.gap.result import Diagnosis
from airtouch.logs import read
from airtouch.logs.flight_log import FlightLog
from crazypad_labels import VEHICLE as CRAZYPAD_VEHICLE
from crazypad_labels import building, family, manifest
from gap_authors import VEHICLE as AUTHORS_VEHICLE
from gap_authors import questions
from gap_peers import NAMES
from gap_real_table import answer, print_table

OTHERS = 5  #: most baseline flights of one; as tools/nominal_scatter.py, whose table the diagnosis uses
PER_GROUP = 4  #: flights tested of a day and condition; no source: enough for a count, few enough for time
LEAST_GROUP = 3  #: nominal flights of a group, for each to have two others
#: the authors' folds and neural-swarm's days of the part "build" (host/docs/looks.md)
BUILD_FOLDS, BUILD_DAYS = ("0", "1", "2"), ("19", "20")
#: (row, truth) -> flights of --quick
QUICK = {("swarm", "ground_effect"): 1, ("crazypad", "normal"): 1, ("crazypad", "rotor damage"): 2,
         ("crazypad", "slung load"): 1, ("peers", "weak_motor"): 1}
QUICK_WRONG = 1  #: of the flights of --quick, at most: it tells a broken diagnosis, not a slightly worse one


@dataclass(frozen=True)
class Case:
    """One flight to be diagnosed: truth is only read afterwards."""

    row: str
    truth: str
    vehicle: str
    flight: str
    baseline: tuple[str, ...]
    condition: str = ""
    partner: tuple[tuple[str, float], ...] = ()  #: logs of other vehicles, and when they begin after this flight, s


def authors(folder: Path, part: str) -> Iterator[Case]:
    """Nominal flights of the authors against five others of the same day and condition."""
    for files in _calm_groups(folder, part).values():
        if len(files) <= OTHERS:
            continue
        step = max(len(files) // PER_GROUP, 1)
        for flight in files[::step][:PER_GROUP]:
            others = [f for f in files if f != flight][:OTHERS]
            yield Case("authors", "none", AUTHORS_VEHICLE, flight, tuple(others))


def swarm(folder: Path, part: str) -> Iterator[Case]:
    """Neural-swarm's flights with ground effect, under another's wake, and neither."""
    own = folder / "neuralswarm"
    base = defaultdict(list)
    for r in csv.DictReader((own / "baselines.csv").open()):
        base[r["group"]].append(str(own / "flights" / r["file"]))
    for r in csv.DictReader((own / "manifest.csv").open()):
        if _in_part(part, r["day"] in BUILD_DAYS):
            yield Case("swarm", r["truth"], str(own / f"{r['vehicle']}.toml"), str(own / "flights" / r["file"]),
                       tuple(base[r["group"]]), r["vehicle"])


def with_partners(cases: Iterable[Case], folder: Path) -> list[Case]:
    """Cases of neural-swarm with the paths of other vehicles, as far as the data hold cuts of the same time."""
    own = folder / "neuralswarm"
    cuts = {r["file"]: r for r in swarm_cuts.cuts(own)}
    out = []
    for case in cases:
        row = cuts.get(Path(case.flight).name)
        partner = () if row is None else tuple(
            (str(own / "flights" / other["file"]), swarm_cuts.delay_s(row, other)) for other in cuts.values()
            if swarm_cuts.partners(row, other) and swarm_cuts.overlap(row, other))
        out.append(replace(case, partner=partner))
    return out


def _delay_clock(path: str, seconds: float) -> FlightLog:
    """A log whose clock begins later by so many seconds."""
    log = read(path)
    return FlightLog({**log.columns, "t_s": log["t_s"] + seconds}, log.meta)


def nominal(folder: Path, part: str) -> Iterator[Case]:
    """Every nominal flight against the others of its group.

    A group of the authors' is a day and condition, one of neural-swarm's the baseline flights of a drone and day.
    """
    groups: defaultdict[tuple[str, ...], list[str]] = defaultdict(list)
    for group, files in _calm_groups(folder, part).items():
        groups[AUTHORS_VEHICLE, "the authors'", *group] = files
    own = folder / "neuralswarm"
    vehicle_and_day = {r["group"]: (r["vehicle"], r["day"]) for r in csv.DictReader((own / "manifest.csv").open())}
    for r in csv.DictReader((own / "baselines.csv").open()):
        if r["group"] in vehicle_and_day and _in_part(part, vehicle_and_day[r["group"]][1] in BUILD_DAYS):
            vehicle = vehicle_and_day[r["group"]][0]
            groups[str(own / f"{vehicle}.toml"), vehicle, r["group"]].append(str(own / "flights" / r["file"]))
    for (vehicle, condition, *_), files in groups.items():
        for flight in files if len(files) >= LEAST_GROUP else ():
            yield Case("nominal", "none", vehicle, flight, tuple(f for f in files if f != flight)[:OTHERS], condition)


def crazypad(folder: Path, part: str) -> Iterator[Case]:
    """CrazyPAD's flights against the other normal ones of the same drone; truth is the family of the defect."""
    own = folder / "crazypad"
    rows = manifest(own, "all")
    normal = [r for r in rows if family(r["condition"]) == "normal"]
    for r, build in zip(rows, building(rows), strict=True):
        if _in_part(part, build):
            others = tuple(str(own / o["file"]) for o in normal if o["drone"] == r["drone"] and o["file"] != r["file"])
            yield Case("crazypad", family(r["condition"]), CRAZYPAD_VEHICLE, str(own / r["file"]), others,
                       r["condition"])


def fan(folder: Path, part: str) -> Iterator[Case]:
    """The authors' flight past a fan, against five calm flights of its day."""
    flights, calm = questions(folder / "airtouch")["wind"]
    if _in_part(part, True):
        for flight in flights:
            yield Case("fan", "comes and goes", AUTHORS_VEHICLE, flight, tuple(calm[:OTHERS]))


def peers(folder: Path, part: str) -> Iterator[Case]:
    """Flights of other people's simulators."""
    own = folder / "peers"
    for r in csv.DictReader((own / "manifest.csv").open()):
        if not r["file"].startswith("cal") and _in_part(part, False):
            yield Case("peers", NAMES.get(r["effect"], r["effect"]), str(own / f"vehicle_{r['vehicle'].lower()}.toml"),
                       str(own / r["file"]), tuple(str(own / f"cal_{r['vehicle']}_{i}.csv.gz") for i in (0, 1)))


def _calm_groups(folder: Path, part: str) -> dict[tuple[str, ...], list[str]]:
    """Clean flights of the authors in still air: (day, height, angle) -> files."""
    groups: defaultdict[tuple[str, ...], list[str]] = defaultdict(list)
    for r in csv.DictReader((folder / "airtouch" / "manifest.csv").open()):
        if r["use"] == "clean" and r["wind"] == "none" and _in_part(part, r["fold"] in BUILD_FOLDS):
            group = r["file"].split("_")[2][:4], r["height"], r["angle_deg"]
            groups[group].append(str(folder / "airtouch" / r["file"]))
    return groups


def _in_part(part: str, build: bool) -> bool:
    """Whether a flight is of a part; build: whether it is one to build on."""
    return part == "all" or build == (part == "build")


#: (vehicle, baseline) -> this process's last diagnosis, whose calibration serves the next case of the same two
_LAST: dict[tuple[str, tuple[str, ...]], Diagnosis] = {}
#: name of a row -> its cases in a folder of flights and a part
ROWS = {"authors": authors, "swarm": swarm, "crazypad": crazypad, "fan": fan, "peers": peers, "nominal": nominal}
DEFAULT_ROWS = [row for row in ROWS if row != "nominal"]  #: without the one that takes 25 min


def diagnose_case(case: Case) -> dict:
    """A case with its diagnosis."""
    started = time.perf_counter()
    out = {"row": case.row, "truth": case.truth, "condition": case.condition, "flight": Path(case.flight).name,
           "baseline": len(case.baseline), "effects": []}
    try:
        diagnosis = diagnose([read(case.flight)], vehicles.load(case.vehicle), [read(b) for b in case.baseline],
                             before=_LAST.get((case.vehicle, case.baseline)),
                             partner=[_delay_clock(*p) for p in case.partner])
    except AirTouchError as error:
        return {**out, "verdict": "refused", "why": str(error)}
    _LAST.clear()
    _LAST[case.vehicle, case.baseline] = diagnosis
    return {**out, "verdict": diagnosis.verdict, "effects": diagnosis.plain()["effects"], "gap": diagnosis.gap,
            "ranking": {r.name: round(r.probability, 4) for r in diagnosis.ranking[:6]},
            "seconds": time.perf_counter() - started}


def quick(cases: list[Case]) -> list[Case]:
    """The first few of each row and truth that QUICK names, evenly chosen."""
    out = []
    for (row, truth), many in QUICK.items():
        alike = [c for c in cases if c.row == row and c.truth == truth]
        out += alike[::max(len(alike) // many, 1)][:many]
    return out


def diagnoses(cases: list[Case], store: Path | None, jobs: int) -> list[dict]:
    """Cases with their diagnoses, by `jobs` processes; those in the file `store` are read, others appended to it."""
    answer_of = {}
    if store and store.exists():
        answer_of = {(c["row"], c["flight"]): c for c in map(json.loads, store.read_text().splitlines())}
    todo = sorted((c for c in cases if (c.row, Path(c.flight).name) not in answer_of),
                  key=lambda c: (c.row, c.vehicle, c.baseline))
    with ProcessPoolExecutor(max(jobs, 1), multiprocessing.get_context("spawn")) as pool:  # with no memory of ours
        for i, case in enumerate(pool.map(diagnose_case, todo)):
            answer_of[case["row"], case["flight"]] = case
            if store:
                with store.open("a") as out:
                    out.write(json.dumps(case) + "\n")
            print(f"{i + 1}/{len(todo)} {case['truth']}: {answer(case)} {case['flight']}", file=sys.stderr, flush=True)
    return [answer_of[c.row, Path(c.flight).name] for c in cases]


def main(arguments: list[str] | None = None) -> int:
    """Diagnose the cases that the options name, and print the table; 1 where --quick has too many wrong ones."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flights", nargs="?", type=Path,
                        default=Path(os.environ.get("AIRTOUCH_FLIGHTS", "../shared/flights")))
    parser.add_argument("--part", choices=("build", "view", "all"), default="build")
    parser.add_argument("--rows", nargs="+", choices=sorted(ROWS), default=DEFAULT_ROWS)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", type=Path, help="JSON lines; cases that it holds are not diagnosed again")
    parser.add_argument("--partner", action="store_true",
                        help="give neural-swarm's flights the paths of other vehicles that the data hold")
    parser.add_argument("--quick", action="store_true",
                        help=f"fails where more than {QUICK_WRONG} of its flights are wrong")
    args = parser.parse_args(arguments)
    if args.quick:  # of the parts for building, and two peers
        cases = quick([c for row in DEFAULT_ROWS
                       for c in ROWS[row](args.flights, "view" if row == "peers" else "build")])
    else:
        cases = [c for row in args.rows for c in ROWS[row](args.flights, args.part)]
    if args.partner:
        cases = with_partners(cases, args.flights)
    answers = diagnoses(cases, args.keep, args.jobs)
    print_table(answers, args.flights)
    wrong = [c["flight"] for c in answers if answer(c) != c["truth"]]
    if args.quick and len(wrong) > QUICK_WRONG:
        print(f"gap_real: {len(wrong)} of {len(answers)} wrong, more than {QUICK_WRONG}: {', '.join(wrong)}",
              file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
