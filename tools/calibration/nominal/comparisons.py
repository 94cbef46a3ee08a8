"""Nominal flights, each compared with others on which its vehicle is calibrated: how strong every effect seems."""

import multiprocessing
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.evenly import evenly_spaced
from airtouch.gap.flights.flight import Flight, ready
from airtouch.gap.nominal import calibrate
from airtouch.gap.nominal.apparent import apparent_strengths, passing_sizes
from airtouch.gap.signatures.scatter import ApparentStrengths
from airtouch.gap.study import Study
from airtouch.logs import json_lines
from airtouch.simulation import effects
from airtouch.vehicle import Vehicle

from .groups import Group, Log

MOST = 5  #: baseline flights of one, at most; no source: round number, for time


class Task(NamedTuple):
    """Flights of a group to be compared with `others`, of other groups of its drone; None: with those of the group.

    passing: whether only passing effects are measured; only: names of the effects that are, () for all.
    """

    group: Group
    others: list[Log] | None = None
    passing: bool = False
    only: tuple[str, ...] = ()

    @property
    def note(self) -> str:
        """What is added to the names of the comparisons."""
        return (", other groups" * (self.others is not None) + ", passing effects" * self.passing
                + f", {' '.join(self.only)}" * bool(self.only))


def compare_all(tasks: Sequence[Task], keep: Path | None, jobs: int) -> dict[str, dict]:
    """Name of a comparison -> its row, of all tasks; rows in the file `keep` are taken from there, new ones added."""
    row_of = {r["file"]: r for r in json_lines.read(keep)}
    todo = [task for task in tasks if any(name + task.note not in row_of for name, _ in task.group.logs)]
    # forked processes need not import anything again
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("fork")) as pool:
        for done, (task, rows) in enumerate(zip(todo, pool.map(_rows_of, todo), strict=True), 1):
            row_of |= {row["file"]: row for row in rows}
            json_lines.append(keep, rows)
            print(f"{done} of {len(todo)}: {task.group.of}, {task.group.name}{task.note}: {len(rows)} flights",
                  file=sys.stderr, flush=True)
    return row_of


def tasks_of(groups: Sequence[Group], only: tuple[str, ...] = ()) -> list[Task]:
    """Each group against itself and, where its drone has two or more flights in other groups, against those.

    only: names of the effects that are measured, () for all.
    """
    out = []
    for group in groups:
        others = [log for other in groups if other.drone == group.drone and other.name != group.name
                  for log in other.logs]
        out += [Task(group, only=only), *([Task(group, others, only=only)] if len(others) > 1 else [])]
    return out


def held_out(logs: list[Log], vehicle: Vehicle, others: list[Log] | None = None,
             look: Callable[[Data], ApparentStrengths] = apparent_strengths) -> Iterator[tuple[str, ApparentStrengths]]:
    """(Name, `look` at it) of each flight, against others of its group or against `others`."""
    flights = _ready(logs, vehicle)
    if others is not None:
        study = _study(vehicle, [f for _, f in _ready(evenly_spaced(others, MOST), vehicle)])
    for i, (name, flight) in enumerate(flights):
        if others is None:
            study = _study(vehicle, [f for k, (_, f) in enumerate(flights) if k != i])
        yield name, look(Data(study, [flight]))


def _study(vehicle: Vehicle, base: list[Flight]) -> Study:
    """The vehicle, calibrated on MOST of the flights at most."""
    return calibrate.calibrated(vehicle, evenly_spaced(base, MOST), scatter=False)[0]


def _ready(logs: list[Log], vehicle: Vehicle) -> list[tuple[str, Flight]]:
    """The flights of logs, with their names. Raises AirTouchError for a log that cannot be used."""
    return [(name, ready(log(), vehicle)) for name, log in logs]


def _rows_of(task: Task) -> list[dict]:
    """The rows of a task's comparisons, one for each flight of the group; JSON-ready."""
    without = [name for name in effects.NAMES if name not in task.only] if task.only else []
    comparisons = held_out(task.group.logs, task.group.vehicle, task.others,
                           passing_alone if task.passing else partial(apparent_strengths, without=without))
    return [{"file": name + task.note, "rate": apparent.rate, "passing": dict(apparent.passing),
             "strengths": {k: v.tolist() for k, v in apparent.strengths.items()},
             "errors": {k: v.tolist() for k, v in apparent.errors.items()}} for name, apparent in comparisons]


def passing_alone(data: Data) -> ApparentStrengths:
    """Passing effects in a flight, and nothing else."""
    return ApparentStrengths({}, {}, 0.0, passing_sizes(data))
