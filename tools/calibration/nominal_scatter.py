"""Measures how strong every effect seems to be in nominal flights, for gap/signatures/nominal_scatter.toml.

    python tools/calibration/nominal_scatter.py [FLIGHTS] [--out nominal_scatter.toml] [--keep cases.jsonl]    # hours

Every nominal flight is compared twice with up to five others of its vehicle, on which the vehicle is calibrated: with
flights of its own group (drone, day and condition), and with flights of other groups of the same drone. Strengths of
both comparisons count, rates of the first alone. Authors' flights of folds 0 to 2; neural-swarm's days 19 and 20;
simulated flights of this project. host/docs/gap-floor.md explains the table.

    python tools/calibration/nominal_scatter.py [FLIGHTS] --passing    # 5 min

measures nothing but passing effects, in the same flights of the same groups. It writes the table that is shipped with
these figures in place of the old ones. Both write --out; to ship a table, give it the path of the shipped one.
"""

import argparse
import csv
import multiprocessing
import os
import re
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from importlib import resources
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np

from airtouch import vehicle as vehicles
from airtouch.cli.shared.flights import check_data_set, data_folder
from airtouch.detector.evaluation.data.dataset import collect
from airtouch.detector.evaluation.data.folds import BUILD_FOLDS, still_air
from airtouch.errors import in_one_line
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import Flight, ready_flights
from airtouch.gap.nominal import calibrate
from airtouch.gap.nominal.apparent import apparent_strengths, passing_sizes
from airtouch.gap.sealed import make as sealed
from airtouch.gap.signatures import scatter_estimates
from airtouch.gap.signatures.scatter import ApparentStrengths, Scatter, table
from airtouch.gap.signatures.scatter_estimates import class_scatter
from airtouch.logs import json_lines, read
from airtouch.logs.files import check_free
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.batch import flights as simulated
from airtouch.vehicle import Vehicle

MOST = 5  #: baseline flights of one, at most; no source: round number, for time
LEAST = 4  #: flights of a group; no source: three baseline flights for each
SIMULATED = 4  #: groups of simulated flights; no source: round number
#: scenarios that draw each flight's rotors and battery, one group each of so many flights; no source: of the shipped
#: ones those least alike
OWN_TRIM, OWN_TRIM_FLIGHTS = ("paper-low", "paper-9cm", "paper-mixed", "steps"), 6
BUILD_DAYS = ("19", "20")  #: of neural-swarm, on which numbers may be chosen (host/docs/looks.md)
#: a log's name, and a function that reads it, which can be sent to a worker process
Log = tuple[str, Callable[[], FlightLog]]


class Group(NamedTuple):
    """Nominal flights of one drone on one day, in one condition."""

    of: str  #: class of the table: vehicle and kind of log
    drone: str
    name: str
    vehicle: Vehicle
    logs: list[Log]


class Task(NamedTuple):
    """Flights of a group to be compared with others: of other groups of the same drone; None for their own group."""

    group: Group
    others: list[Log] | None = None

    @property
    def note(self) -> str:
        """What is added to the names of the comparisons."""
        return "" if self.others is None else ", other groups"


def pool_of(jobs: int) -> ProcessPoolExecutor:
    """Worker processes, which are forked: they need not import anything again."""
    return ProcessPoolExecutor(jobs, multiprocessing.get_context("fork"))


def nominal_groups(folder: Path) -> Iterator[Group]:
    """The groups of nominal flights, recorded and simulated."""
    vehicle = vehicles.load("crazyflie-2.1-flow")
    build = [file for file in collect([folder / "airtouch"]) if file.condition.fold in BUILD_FOLDS]
    for key, alike in still_air(build).items():
        yield Group("crazyflie, flow deck, radio log", "the authors'", " ".join(key), vehicle,
                    [_read(file.path) for file in alike])
    swarm = folder / "neuralswarm"
    by_group = defaultdict(list)
    for name in ("baselines.csv", "manifest.csv"):
        for r in csv.DictReader((swarm / name).open()):
            if r["day"] in BUILD_DAYS and r.get("truth", "none") == "none":
                by_group[r["cf"], r["group"], r["vehicle"]].append(_read(swarm / "flights" / r["file"]))
    for (drone, group, of), files in by_group.items():
        yield Group(f"motion capture, uSD log, {of}", drone, group, vehicles.load(swarm / f"{of}.toml"), files)
    vehicle = vehicles.load(sealed.VEHICLE)
    for seed in range(SIMULATED):
        logs = sealed.nominal(vehicle, sealed.CAL_FIRST, sealed.CAL, seed)
        simulated_logs: list[Log] = [(f"simulated {seed} {i}", partial(nothing_done, log))
                                     for i, log in enumerate(logs)]
        yield Group(scatter_estimates.SIMULATED, f"seed {seed}", f"seed {seed}", vehicle, simulated_logs)
    for scene in OWN_TRIM:
        flown = simulated(scene, OWN_TRIM_FLIGHTS, vehicle=vehicle, workers=1)
        logs = [sealed.stripped(log) for log in flown if isinstance(log, FlightLog)]
        named_logs: list[Log] = [(f"{scene} {i}", partial(nothing_done, log)) for i, log in enumerate(logs)]
        yield Group(scatter_estimates.OWN_TRIM, scene, scene, vehicle, named_logs)


def nothing_done(log: FlightLog) -> FlightLog:
    """A log that is here already."""
    return log


def _read(path: Path) -> Log:
    """A log's name, and a function that reads it."""
    return path.name, partial(read, path)


def held_out(logs: list[Log], vehicle: Vehicle, others: list[Log] | None = None,
             look: Callable[[Data], ApparentStrengths] = apparent_strengths) -> Iterator[tuple[str, ApparentStrengths]]:
    """(Name, `look` at it) of each flight, against others of its group or against `others`."""
    ready = _ready(logs, vehicle)
    if others is not None:
        base = [f for _, f in _ready(_evenly_spaced(others), vehicle)]
        study, _ = calibrate.calibrated(vehicle, _evenly_spaced(base), scatter=False)
    for i, (name, flight) in enumerate(ready):
        if others is None:
            study, _ = calibrate.calibrated(vehicle, _evenly_spaced([f for k, (_, f) in enumerate(ready) if k != i]),
                                            scatter=False)
        yield name, look(Data(study, [flight]))


def _compare(task: Task) -> list[dict]:
    """The rows of a task's comparisons, one for each flight of the group; JSON-ready."""
    comparisons = held_out(task.group.logs, task.group.vehicle, task.others)
    return [{"file": name + task.note, "rate": apparent.rate, "passing": dict(apparent.passing),
             "strengths": {k: v.tolist() for k, v in apparent.strengths.items()},
             "errors": {k: v.tolist() for k, v in apparent.errors.items()}} for name, apparent in comparisons]


def passing_alone(data: Data) -> ApparentStrengths:
    """Passing effects in a flight, and nothing else."""
    return ApparentStrengths({}, {}, 0.0, passing_sizes(data))


def _passing_of(group: Group) -> list[ApparentStrengths]:
    """Passing effects in every flight of a group, compared with the others."""
    return [apparent for _, apparent in held_out(group.logs, group.vehicle, look=passing_alone)]


def with_passing(pool: ProcessPoolExecutor, groups: list[Group]) -> dict[str, Scatter]:
    """The classes of the table that is shipped, with passing effects in their flights measured anew."""
    flights = defaultdict(list)
    for group, sizes in zip(groups, pool.map(_passing_of, groups), strict=True):
        flights[group.of] += sizes
    return {of: replace(one, passing=class_scatter(flights[of]).passing) for of, one in table().items()}


def counts_of(text: str) -> dict[str, str]:
    """How many flights each class of a table was measured on, by its comments."""
    return dict(re.findall(r'^\["(.+)"\]  # (.+)$', text, re.MULTILINE))


def _rest(groups: list[Group], own: Group) -> list[Log]:
    """Flights of a group's drone in other groups."""
    return [log for group in groups if group.drone == own.drone and group.name != own.name for log in group.logs]


def _ready(logs: list[Log], vehicle: Vehicle) -> list[tuple[str, Flight]]:
    """The flights of logs that can be used, with their names."""
    return list(zip([name for name, _ in logs], ready_flights([log() for _, log in logs], vehicle, []), strict=True))


def _evenly_spaced(items: list) -> list:
    """At most MOST of them, evenly chosen."""
    return [items[k] for k in np.unique(np.linspace(0, len(items) - 1, MOST).astype(int))]


def text_of(classes: dict[str, Scatter], counts: dict[str, str]) -> str:
    """The table as TOML."""
    lines = ["# Root mean square of the apparent strength of every effect, in its natural steps (term.Term), in",
             "# nominal flights held against others; made by tools/calibration/nominal_scatter.py.", ""]
    for name, s in classes.items():
        lines += [f'["{name}"]  # {counts[name]}', *([f'vehicle = "{s.vehicle}"'] if s.vehicle else []),
                  f"freedom = {s.freedom:g}", f"root_rate = [{s.rate[0]:.3f}, {s.rate[1]:.3f}]",
                  f'["{name}".passing]']
        lines += [f"{k} = [{mean:.3f}, {spread:.3f}]" for k, (mean, spread) in s.passing.items()]
        lines.append(f'["{name}".rms]')
        lines += [f"{k} = [{', '.join(f'{x:.4g}' for x in v)}]" for k, v in s.rms.items()]
        lines.append(f'["{name}".middle]')
        lines += [f"{k} = [{', '.join(f'{x:.4g}' for x in v)}]" for k, v in s.middle.items()]
        lines.append("")
    return "\n".join(lines)


def compare_all(groups: list[Group], keep: Path | None, jobs: int) -> dict[str, dict]:
    """Name of a comparison -> its row, of all groups; rows in the file `keep` are taken from there, new ones added."""
    row_of = {r["file"]: r for r in json_lines.read(keep)}
    tasks = [task for group in groups for task in (Task(group), Task(group, _rest(groups, group)))
             if any(name + task.note not in row_of for name, _ in group.logs)
             and (task.others is None or len(task.others) > 1)]
    with pool_of(jobs) as pool:
        for task, rows in zip(tasks, pool.map(_compare, tasks), strict=True):
            row_of |= {row["file"]: row for row in rows}
            json_lines.append(keep, rows)
            print(f"{task.group.of}, {task.group.name}{task.note}: {len(rows)} flights",
                  file=sys.stderr, flush=True)
    return row_of


def scatter_of_classes(groups: list[Group], row_of: dict[str, dict]) -> tuple[dict[str, Scatter], dict[str, str]]:
    """Class -> its scatter, and class -> on how many flights it was measured, from the rows of `compare_all`."""
    cases, alike, names, flown_by = defaultdict(list), defaultdict(list), defaultdict(set), {}
    for group in groups:
        names[group.of].add(group.name)
        flown_by[group.of] = group.vehicle.name
        for task in (Task(group), Task(group, [])):
            files = [name + task.note for name, _ in group.logs]
            for row in (row_of[file] for file in files if file in row_of):
                cases[group.of].append(_apparent(row))
                if task.others is None:
                    alike[group.of].append(cases[group.of][-1])
    classes = {of: replace(class_scatter(flights, alike[of]), vehicle=flown_by[of]) for of, flights in cases.items()}
    counts = {of: f"{len(alike[of])} flights, {len(flights)} comparisons in {len(names[of])} groups"
              for of, flights in cases.items()}
    return classes, counts


def _apparent(row: dict) -> ApparentStrengths:
    """What a row of `_compare` holds."""
    strengths, errors = ({k: np.array(v) for k, v in row[part].items()} for part in ("strengths", "errors"))
    return ApparentStrengths(strengths, errors, row["rate"], row["passing"])


def main() -> None:
    """Measure the nominal scatter of every class and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flights", nargs="?", type=Path, default=data_folder(),
                        help="of the data sets (default: AIRTOUCH_FLIGHTS or ../shared/flights)")
    parser.add_argument("--out", type=Path, default=Path("nominal_scatter.toml"),
                        help="the table, which is replaced if it is there (default %(default)s)")
    parser.add_argument("--keep", type=Path, help="JSON lines; comparisons that it holds are not made again")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default %(default)s)")
    parser.add_argument("--passing", action="store_true", help="measure passing effects alone")
    args = parser.parse_args()
    check_data_set(args.flights / "airtouch")
    check_data_set(args.flights / "neuralswarm", "baselines.csv")
    for path in (args.out, args.keep):
        check_free(path, force=True)
    large_enough = [g for g in nominal_groups(args.flights) if len(g.logs) >= LEAST]
    if args.passing:
        with pool_of(args.jobs) as pool:
            shipped = resources.files("airtouch") / "gap" / "signatures" / "nominal_scatter.toml"
            write(args.out, text_of(with_passing(pool, large_enough), counts_of(shipped.read_text(encoding="utf-8"))))
    else:
        write(args.out, text_of(*scatter_of_classes(large_enough, compare_all(large_enough, args.keep, args.jobs))))


def write(path: Path, text: str) -> None:
    """Write a table and print it."""
    new = path.with_suffix(".new")
    new.write_text(text)
    new.rename(path)
    print(text)


if __name__ == "__main__":
    with in_one_line("nominal_scatter"):
        main()
