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
import os
import sys
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np

import gap_crazypad
import gap_lift
from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.gap.diagnose import diagnose
from airtouch.gap.result import Diagnosis
from airtouch.gap.sealed.blind import interchangeable
from airtouch.gap.sealed.blind_score import wilson
from airtouch.logs import read
from airtouch.logs.flight_log import FlightLog
from gap_authors import questions
from gap_peers import NAMES

OTHERS = 5  #: of the authors' flights, that one is held against
PER_GROUP = 4  #: flights tested of a day and condition
LEAST_GROUP = 3  #: nominal flights of a group, for each to have two others
BUILD_FOLDS, BUILD_DAYS = ("0", "1", "2"), ("19", "20")
COMES_AND_GOES = ("gust", "wind", "downwash")  #: names that say so of the fan, where they have seconds
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
    made: defaultdict[tuple[str, ...], list[str]] = defaultdict(list)
    for r in csv.DictReader((folder / "airtouch" / "manifest.csv").open()):
        if r["use"] == "clean" and r["wind"] == "none" and _wanted(part, r["fold"] in BUILD_FOLDS):
            made[r["file"].split("_")[2][:4], r["height"], r["angle_deg"]].append(str(folder / "airtouch" / r["file"]))
    for files in made.values():
        if len(files) <= OTHERS:
            continue
        step = max(len(files) // PER_GROUP, 1)
        for flight in files[::step][:PER_GROUP]:
            others = [f for f in files if f != flight][:OTHERS]
            yield Case("authors", "none", "crazyflie-2.1-flow", flight, tuple(others))


def swarm(folder: Path, part: str) -> Iterator[Case]:
    """Neural-swarm's flights with ground effect, under another's wake, and neither."""
    own = folder / "neuralswarm"
    base = defaultdict(list)
    for r in csv.DictReader((own / "baselines.csv").open()):
        base[r["group"]].append(str(own / "flights" / r["file"]))
    for r in csv.DictReader((own / "manifest.csv").open()):
        if _wanted(part, r["day"] in BUILD_DAYS):
            yield Case("swarm", r["truth"], str(own / f"{r['vehicle']}.toml"), str(own / "flights" / r["file"]),
                       tuple(base[r["group"]]), r["vehicle"])


def with_partners(cases: Iterable[Case], folder: Path) -> list[Case]:
    """Cases of neural-swarm with the paths of other vehicles, as far as the data hold cuts of the same time."""
    own = folder / "neuralswarm"
    cuts = {r["file"]: r for name in ("manifest.csv", "baselines.csv") for r in csv.DictReader((own / name).open())}

    def flown(r: dict[str, str]) -> tuple[str, str]:
        day, name = r["flight"].rsplit("/", 1)
        return day, name.split("_")[1]

    out = []
    for case in cases:
        mine = cuts.get(Path(case.flight).name)
        others = [] if mine is None else [r for r in cuts.values() if flown(r) == flown(mine) and r["cf"] != mine["cf"]]
        out.append(replace(case, partner=tuple(
            (str(own / "flights" / r["file"]), float(r["start_s"]) - float(mine["start_s"])) for r in others if mine
            and float(r["start_s"]) < float(mine["stop_s"]) and float(mine["start_s"]) < float(r["stop_s"]))))
    return out


def _later(path: str, seconds: float) -> FlightLog:
    """A log whose clock begins later by so many seconds."""
    log = read(path)
    return FlightLog({**log.columns, "t_s": log["t_s"] + seconds}, log.meta)


def nominal(folder: Path, part: str) -> Iterator[Case]:
    """Every nominal flight against the others of its group.

    A group of the authors' is a day and condition, one of neural-swarm's the baseline flights of a drone and day.
    """
    made: defaultdict[tuple[str, ...], list[str]] = defaultdict(list)
    for r in csv.DictReader((folder / "airtouch" / "manifest.csv").open()):
        if r["use"] == "clean" and r["wind"] == "none" and _wanted(part, r["fold"] in BUILD_FOLDS):
            group = ("crazyflie-2.1-flow", "the authors'", r["file"].split("_")[2][:4], r["height"], r["angle_deg"])
            made[group].append(str(folder / "airtouch" / r["file"]))
    own = folder / "neuralswarm"
    of = {r["group"]: (r["vehicle"], r["day"]) for r in csv.DictReader((own / "manifest.csv").open())}
    for r in csv.DictReader((own / "baselines.csv").open()):
        if r["group"] in of and _wanted(part, of[r["group"]][1] in BUILD_DAYS):
            vehicle = of[r["group"]][0]
            made[str(own / f"{vehicle}.toml"), vehicle, r["group"]].append(str(own / "flights" / r["file"]))
    for (flown, condition, *_), files in made.items():
        for flight in files if len(files) >= LEAST_GROUP else ():
            yield Case("nominal", "none", flown, flight, tuple(f for f in files if f != flight)[:OTHERS], condition)


def crazypad(folder: Path, part: str) -> Iterator[Case]:
    """CrazyPAD's flights against the other normal ones of the same drone; truth is the family of the defect."""
    own = folder / "crazypad"
    rows = list(csv.DictReader((own / "manifest.csv").open()))
    normal = [r for r in rows if gap_crazypad.family(r["condition"]) == "normal"]
    for r, built in zip(rows, gap_crazypad.building(rows), strict=True):
        if _wanted(part, built):
            others = tuple(str(own / o["file"]) for o in normal if o["drone"] == r["drone"] and o["file"] != r["file"])
            yield Case("crazypad", gap_crazypad.family(r["condition"]), "crazyflie-2.1", str(own / r["file"]), others,
                       r["condition"])


def fan(folder: Path, part: str) -> Iterator[Case]:
    """The authors' flight past a fan, against five calm flights of its day."""
    flights, calm = questions(folder / "airtouch")["wind"]
    if _wanted(part, True):
        for flight in flights:
            yield Case("fan", "comes and goes", "crazyflie-2.1-flow", flight, tuple(calm[:OTHERS]))


def peers(folder: Path, part: str) -> Iterator[Case]:
    """Flights of other people's simulators."""
    own = folder / "peers"
    for r in csv.DictReader((own / "manifest.csv").open()):
        if not r["file"].startswith("cal") and _wanted(part, False):
            yield Case("peers", NAMES.get(r["effect"], r["effect"]), str(own / f"vehicle_{r['vehicle'].lower()}.toml"),
                       str(own / r["file"]), tuple(str(own / f"cal_{r['vehicle']}_{i}.csv.gz") for i in (0, 1)))


def _wanted(part: str, build: bool) -> bool:
    return part == "all" or build == (part == "build")


#: of this process, whose calibration serves the next case alike
_LAST: dict[tuple[str, tuple[str, ...]], Diagnosis] = {}
ROWS = {"authors": authors, "swarm": swarm, "crazypad": crazypad, "fan": fan, "peers": peers, "nominal": nominal}
USUAL = [row for row in ROWS if row != "nominal"]


def answered(case: Case) -> dict:
    """A case with its diagnosis."""
    started = time.perf_counter()
    out = {"row": case.row, "truth": case.truth, "condition": case.condition, "flight": Path(case.flight).name,
           "baseline": len(case.baseline), "effects": []}
    try:
        told = diagnose([read(case.flight)], vehicles.load(case.vehicle), [read(b) for b in case.baseline],
                        before=_LAST.get((case.vehicle, case.baseline)),
                        partner=[_later(*p) for p in case.partner])
    except AirTouchError as error:
        return {**out, "verdict": "refused", "why": str(error)}
    _LAST.clear()
    _LAST[case.vehicle, case.baseline] = told
    found = told.plain()
    return {**out, "verdict": told.verdict, "effects": found["effects"], "gap": told.gap,
            "ranking": {r.name: round(r.probability, 4) for r in told.ranking[:6]},
            "seconds": time.perf_counter() - started}


def answer(case: dict) -> str:
    """What a diagnosis says first, in the words of its row's truths."""
    if case["row"] == "crazypad":
        return gap_crazypad.answer(case)[0]
    if case["verdict"] != "effect":
        return case["verdict"]
    first = case["effects"][0]
    if case["row"] == "fan" and first["name"] in COMES_AND_GOES and first.get("seconds"):
        return "comes and goes"
    if case["row"] == "peers" and interchangeable(first["name"], case["truth"]):
        return case["truth"]
    return first["name"]


def show(cases: list[dict], folder: Path) -> None:
    """One line for each row and truth: hits, their share with its 95 % interval, every answer. folder: the flights."""
    table = defaultdict(lambda: defaultdict(int))
    for c in cases:
        kind = f"{c['row']}, {c['condition']}" if c["row"] in ("swarm", "nominal") else c["row"]
        peers = c["row"] == "peers"
        said = "right" if peers and answer(c) == c["truth"] else answer(c)
        table[kind, "any effect" if peers else c["truth"]][said] += 1
    print("| flights | truth | right | every answer |\n|---|---|---|---|")
    for (row, truth), answers in sorted(table.items()):
        n, hits = sum(answers.values()), answers["right" if row == "peers" else truth]
        share = wilson(hits, n)
        told = ", ".join(f"{name} {k}" for name, k in sorted(answers.items(), key=lambda x: -x[1]) if k)
        print(f"| {row} | {truth} | {hits} of {n} [{share['low']:.0%}, {share['high']:.0%}] | {told} |")
    near = [gap_lift.close(c, folder / "neuralswarm") for c in cases
            if (c["row"], c["truth"]) == ("swarm", "ground_effect")]
    if near:
        share = wilson(sum(near), len(near))
        print(f"neural-swarm, lift within {gap_lift.CLOSE:.0%} of the measured at 2 and 4 cm: "
              f"{sum(near)} of {len(near)} [{share['low']:.0%}, {share['high']:.0%}]")
    seconds = [c["seconds"] for c in cases if "seconds" in c]
    if seconds:
        middle, most = np.quantile(seconds, [0.5, 0.9])
        print(f"{len(seconds)} diagnoses: {middle:.0f} s in the middle, {most:.0f} s at most in nine of ten")
    pads = [{**c, "drone": c["flight"].split("_")[-2]} for c in cases if c["row"] == "crazypad"]
    if pads:
        figures = {"family, balanced": gap_crazypad.balanced, "only damaged rotors named": gap_crazypad.some_named,
                   "severity, Spearman": gap_crazypad.severity}
        for text, figure in figures.items():
            low, high = gap_crazypad.interval(pads, figure)
            print(f"CrazyPAD, {len(pads)} flights: {text} {figure(pads):.2f} (90 % interval {low:.2f} to {high:.2f})")


def quick(cases: list[Case]) -> list[Case]:
    """The first few of each row and truth that QUICK names, evenly chosen."""
    out = []
    for (row, truth), many in QUICK.items():
        some = [c for c in cases if c.row == row and c.truth == truth]
        out += some[::max(len(some) // many, 1)][:many]
    return out


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flights", nargs="?", type=Path,
                        default=Path(os.environ.get("AIRTOUCH_FLIGHTS", "../shared/flights")))
    parser.add_argument("--part", choices=("build", "view", "all"), default="build")
    parser.add_argument("--rows", nargs="+", choices=sorted(ROWS), default=USUAL)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", type=Path, help="JSON lines; cases that it holds are not diagnosed again")
    parser.add_argument("--partner", action="store_true",
                        help="give neural-swarm's flights the paths of other vehicles that the data hold")
    parser.add_argument("--quick", action="store_true",
                        help=f"fails where more than {QUICK_WRONG} of its flights are wrong")
    args = parser.parse_args(arguments)
    if args.quick:  # of the parts for building, and two peers
        cases = quick([c for row in USUAL for c in ROWS[row](args.flights, "view" if row == "peers" else "build")])
    else:
        cases = [c for row in args.rows for c in ROWS[row](args.flights, args.part)]
    if args.partner:
        cases = with_partners(cases, args.flights)
    done = {}
    if args.keep and args.keep.exists():
        done = {(c["row"], c["flight"]): c for c in map(json.loads, args.keep.read_text().splitlines())}
    todo = sorted((c for c in cases if (c.row, Path(c.flight).name) not in done),
                  key=lambda c: (c.row, c.vehicle, c.baseline))
    with ProcessPoolExecutor(max(args.jobs, 1)) as pool:
        for i, case in enumerate(pool.map(answered, todo)):
            done[case["row"], case["flight"]] = case
            if args.keep:
                with args.keep.open("a") as out:
                    out.write(json.dumps(case) + "\n")
            print(f"{i + 1}/{len(todo)} {case['truth']}: {answer(case)} {case['flight']}", file=sys.stderr, flush=True)
    told = [done[c.row, Path(c.flight).name] for c in cases]
    show(told, args.flights)
    wrong = [c["flight"] for c in told if answer(c) != c["truth"]]
    if args.quick and len(wrong) > QUICK_WRONG:
        print(f"gap_real: {len(wrong)} of {len(told)} wrong, more than {QUICK_WRONG}: {', '.join(wrong)}",
              file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
