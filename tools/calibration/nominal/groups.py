"""The groups of nominal flights that the table of nominal scatter is measured on, recorded and simulated."""

import csv
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from airtouch import vehicle as vehicles
from airtouch.detector.evaluation.data.dataset import collect
from airtouch.detector.evaluation.data.folds import BUILD_DAYS, BUILD_FOLDS, still_air
from airtouch.gap.sealed import make as sealed
from airtouch.gap.signatures import scatter_estimates
from airtouch.logs import read
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.batch import flights as simulated
from airtouch.vehicle import Vehicle

SIMULATED = 4  #: groups of simulated flights; no source: round number
#: scenarios that draw each flight's rotors and battery, one group each of so many flights; no source: of the shipped
#: ones those least alike
OWN_TRIM, OWN_TRIM_FLIGHTS = ("paper-low", "paper-9cm", "paper-mixed", "steps"), 6
#: a log's name, and a function that reads it, which can be sent to a worker process
Log = tuple[str, Callable[[], FlightLog]]


class Group(NamedTuple):
    """Nominal flights of one drone on one day, in one condition."""

    of: str  #: class of the table: vehicle and kind of log
    drone: str
    name: str
    vehicle: Vehicle
    logs: list[Log]


def nominal_groups(folder: Path) -> Iterator[Group]:
    """All groups. folder: of the recorded data sets."""
    yield from authors(folder / "airtouch")
    yield from swarm(folder / "neuralswarm")
    yield from same_trim()
    yield from own_trim()


def authors(folder: Path) -> Iterator[Group]:
    """The authors' flights in still air, of the folds for building: a group for each day, height and angle."""
    vehicle = vehicles.load(vehicles.DEFAULT_VEHICLE)
    build = [file for file in collect([folder]) if file.condition.fold in BUILD_FOLDS]
    for key, alike in still_air(build).items():
        yield Group("crazyflie, flow deck, radio log", "the authors'", " ".join(key), vehicle,
                    [_unread(file.path) for file in alike])


def swarm(folder: Path) -> Iterator[Group]:
    """Neural-swarm's nominal flights, of the days for building: a group for each vehicle and day."""
    by_group = defaultdict(list)
    for name in ("baselines.csv", "manifest.csv"):
        for r in csv.DictReader((folder / name).open()):
            if r["day"] in BUILD_DAYS and r.get("truth", "none") == "none":
                by_group[r["cf"], r["group"], r["vehicle"]].append(_unread(folder / "flights" / r["file"]))
    for (drone, group, of), files in by_group.items():
        yield Group(f"motion capture, uSD log, {of}", drone, group, vehicles.load(folder / f"{of}.toml"), files)


def same_trim() -> Iterator[Group]:
    """Simulated flights, those of a group with the same rotors and battery: a group for each seed."""
    vehicle = vehicles.load(sealed.VEHICLE)
    for seed in range(SIMULATED):
        logs = sealed.nominal(vehicle, sealed.CAL_FIRST, sealed.CAL, seed)
        yield Group(scatter_estimates.SIMULATED, f"seed {seed}", f"seed {seed}", vehicle,
                    _in_memory(f"simulated {seed}", logs))


def own_trim() -> Iterator[Group]:
    """Simulated flights, each with rotors and a battery of its own: a group for each scenario of OWN_TRIM."""
    vehicle = vehicles.load(sealed.VEHICLE)
    for scene in OWN_TRIM:
        flown = simulated(scene, OWN_TRIM_FLIGHTS, vehicle=vehicle, workers=1)
        logs = [sealed.stripped(log) for log in flown if isinstance(log, FlightLog)]
        yield Group(scatter_estimates.OWN_TRIM, scene, scene, vehicle, _in_memory(scene, logs))


def itself(log: FlightLog) -> FlightLog:
    """The log, which is in memory already."""
    return log


def _in_memory(name: str, logs: Sequence[FlightLog]) -> list[Log]:
    """Logs that need not be read, numbered behind a name."""
    return [(f"{name} {i}", partial(itself, log)) for i, log in enumerate(logs)]


def _unread(path: Path) -> Log:
    """A log's name, and a function that reads it."""
    return path.name, partial(read, path)
