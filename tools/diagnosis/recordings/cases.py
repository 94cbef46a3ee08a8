"""The cases of tools/gap_real.py: recorded flights, each with its truth and the baseline it is diagnosed against."""

import csv
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from airtouch.detector.evaluation.data.dataset import collect
from airtouch.detector.evaluation.data.folds import BUILD_DAYS, BUILD_FOLDS, still_air
from airtouch.simulation import effects
from airtouch.vehicle import DEFAULT_VEHICLE

from . import peers as peer_flights
from . import swarm_cuts
from .authors import questions
from .crazypad.labels import VEHICLE as CRAZYPAD_VEHICLE
from .crazypad.labels import baseline, building, family, manifest

OTHERS = 5  #: most baseline flights of one; as tools/calibration/nominal_scatter.py, whose table the diagnosis uses
PER_GROUP = 4  #: flights tested of a day and condition; no source: enough for a count, few enough for time
LEAST_GROUP = 3  #: nominal flights of a group, for each to have two others


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
    left_out: tuple[str, ...] = ()  #: effects that are no candidates
    unit: tuple[str, ...] = ()  #: what flights of several days must share: the drone, or height and angle of the passes
    day: str = ""


def authors(folder: Path, part: str) -> Iterator[Case]:
    """Nominal flights of the authors against five others of the same day and condition."""
    for (day, *height_and_angle), files in _calm_groups(folder, part).items():
        if len(files) <= OTHERS:
            continue
        step = max(len(files) // PER_GROUP, 1)
        for flight in files[::step][:PER_GROUP]:
            others = [f for f in files if f != flight][:OTHERS]
            yield Case("authors", "none", DEFAULT_VEHICLE, flight, tuple(others), unit=tuple(height_and_angle), day=day)


def swarm(folder: Path, part: str) -> Iterator[Case]:
    """Neural-swarm's flights with ground effect, under another's wake, and neither."""
    own = folder / "neuralswarm"
    base = defaultdict(list)
    for r in csv.DictReader((own / "baselines.csv").open()):
        base[r["group"]].append(str(own / "flights" / r["file"]))
    for r in csv.DictReader((own / "manifest.csv").open()):
        if _in_part(part, r["day"] in BUILD_DAYS):
            yield Case("swarm", r["truth"], str(own / f"{r['vehicle']}.toml"), str(own / "flights" / r["file"]),
                       tuple(base[r["group"]]), r["vehicle"], unit=(_drone(r),), day=r["day"])


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


def of_another_day(cases: Iterable[Case]) -> Iterator[Case]:
    """Cases against flights of the next day, of those among them, on which the same was flown, the first day after the
    last; none of a drone, or a height and angle, that was flown on one day alone.
    """
    cases = list(cases)
    days: defaultdict[tuple[str, ...], defaultdict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
    for case in cases:
        days[case.unit][case.day].update(case.baseline)
    for case in cases:
        others = sorted(days[case.unit])
        day = others[(others.index(case.day) + 1) % len(others)]
        if case.unit and day != case.day:
            yield replace(case, baseline=tuple(sorted(days[case.unit][day])[:OTHERS]))


def without_truths(cases: Iterable[Case]) -> Iterator[Case]:
    """Cases whose truth is an effect, which is left out of the candidates: to be called `unknown`."""
    for case in cases:
        if case.truth in effects.NAMES:
            yield replace(case, truth="unknown", condition=f"{case.condition} without {case.truth}".lstrip(),
                          left_out=(case.truth,))


def nominal(folder: Path, part: str) -> Iterator[Case]:
    """Every nominal flight against the others of its group.

    A group of the authors' is a day and condition, one of neural-swarm's the baseline flights of a drone and day.
    """
    #: (vehicle, condition, unit, day) -> files
    groups: defaultdict[tuple[str, str, tuple[str, ...], str], list[str]] = defaultdict(list)
    for (day, *height_and_angle), files in _calm_groups(folder, part).items():
        groups[DEFAULT_VEHICLE, "the authors'", tuple(height_and_angle), day] = files
    own = folder / "neuralswarm"
    test_flight = {r["group"]: r for r in csv.DictReader((own / "manifest.csv").open())}
    for r in csv.DictReader((own / "baselines.csv").open()):
        row = test_flight.get(r["group"])
        if row is not None and _in_part(part, row["day"] in BUILD_DAYS):
            vehicle = str(own / f"{row['vehicle']}.toml")
            groups[vehicle, row["vehicle"], (_drone(row),), row["day"]].append(str(own / "flights" / r["file"]))
    for (vehicle, condition, unit, day), files in groups.items():
        for flight in files if len(files) >= LEAST_GROUP else ():
            others = tuple(f for f in files if f != flight)[:OTHERS]
            yield Case("nominal", "none", vehicle, flight, others, condition, unit=unit, day=day)


def crazypad(folder: Path, part: str) -> Iterator[Case]:
    """CrazyPAD's flights against the other normal ones of the same drone; truth is the family of the defect."""
    own = folder / "crazypad"
    rows = manifest(own, "all")
    for i, (r, build) in enumerate(zip(rows, building(rows), strict=True)):
        if _in_part(part, build):
            others = tuple(str(own / rows[k]["file"]) for k in baseline(rows, i))
            yield Case("crazypad", family(r["condition"]), CRAZYPAD_VEHICLE, str(own / r["file"]), others,
                       r["condition"])


def fan(folder: Path, part: str) -> Iterator[Case]:
    """The authors' flight past a fan, against five calm flights of its day."""
    flights, calm = questions(folder / "airtouch")["wind"]
    if _in_part(part, True):
        for flight in flights:
            yield Case("fan", "comes and goes", DEFAULT_VEHICLE, flight, tuple(calm[:OTHERS]))


def peers(folder: Path, part: str) -> Iterator[Case]:
    """Flights of other people's simulators."""
    own = folder / "peers"
    for row in peer_flights.labelled(own):
        if _in_part(part, False):
            yield Case("peers", peer_flights.truth(row), str(peer_flights.vehicle_file(own, row)),
                       str(own / row["file"]), tuple(map(str, peer_flights.baseline(own, row))))


def _calm_groups(folder: Path, part: str) -> dict[tuple[str, str, str], list[str]]:
    """Clean flights of the authors in still air: (day, height, angle) -> files."""
    files = [file for file in collect([folder / "airtouch"]) if _in_part(part, file.condition.fold in BUILD_FOLDS)]
    return {group: [str(file.path) for file in members] for group, members in still_air(files).items()}


def _drone(row: swarm_cuts.Row) -> str:
    """The drone of a row of neural-swarm's manifest, whose group is a drone and a day."""
    return row["group"].removesuffix(f"d{row['day']}")


def _in_part(part: str, build: bool) -> bool:
    """Whether a flight is of a part; build: whether it is one to build on."""
    return part == "all" or build == (part == "build")


#: name of a row -> its cases in a folder of flights and a part
ROWS = {"authors": authors, "swarm": swarm, "crazypad": crazypad, "fan": fan, "peers": peers, "nominal": nominal}
#: name of a row -> folders of the data sets that its cases come from
DATA_SETS = {"authors": ("airtouch",), "swarm": ("neuralswarm",), "crazypad": ("crazypad",), "fan": ("airtouch",),
             "peers": ("peers",), "nominal": ("airtouch", "neuralswarm")}
DEFAULT_ROWS = [row for row in ROWS if row != "nominal"]  #: without the one that takes 25 min
