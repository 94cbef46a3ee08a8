"""A twin fitted to recorded flights: first the rounds of the fit, then the levers that act at edges, then the files."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.logs.files import make_folder
from airtouch.simulation import scenario
from airtouch.simulation.batch import available_cores
from airtouch.simulation.scenario import Scenario
from airtouch.twin import files
from airtouch.twin.fitting import edge_fit, fit
from airtouch.twin.fitting import levers as lever_set
from airtouch.twin.fitting.fit import Target
from airtouch.twin.fitting.levers import Lever
from airtouch.twin.recorded import flights as recorded_flights
from airtouch.twin.recorded.flights import RecordedFlights
from airtouch.vehicle import Vehicle

FIT = "fit.json"  #: file with the state of a fit
#: rounds, and flights per round, of a twin that is fitted for a detector; no source: two thirds of those of `fit`, for
#: time
ROUNDS, BATCH = 8, edge_fit.BATCH
PLAIN = "paper-mixed"  #: scenario to train in if no twin can be fitted
#: bar(stage) is a context manager; its value is called with (done, total, note)
Bars = Callable[[str], AbstractContextManager[Callable[[int, int, str], None]]]


@dataclass(frozen=True)
class Calibration:
    """A fit: its target, its levers and their values (levers,), and the misfit of each round."""

    target: Target
    levers: tuple[Lever, ...]
    values: np.ndarray
    history: list[dict[str, Any]]


@dataclass(frozen=True)
class Twin:
    """A twin: scenario, vehicle, and a description of their origin."""

    scenario: Scenario
    vehicle: Vehicle
    what: str


def of_folder(folder: Path) -> Twin:
    """The twin in a folder that `airtouch twin` wrote. Raises AirTouchError if it cannot be read."""
    return Twin(scenario.load(folder / files.SCENARIO), vehicles.load(str(folder / files.VEHICLE)), f"twin of {folder}")


def of_flights(paths: Sequence[Path], vehicle: Vehicle, work: Path, *, speed_mps: float | None = None, seed: int = 0,
               bar: Bars) -> Twin:
    """A twin fitted to flights over a platform that have every sensor; the plain simulator if there are too few.

    work: folder for the fit; the same call does not fit again. speed_mps: commanded speed of flights without one in
    their manifest.
    """
    least = recorded_flights.MIN_FLIGHTS
    if len(paths) < least:
        return Twin(scenario.load(PLAIN), vehicle, f"no twin: it needs {least} flights over a platform with "
                    f"acceleration, gyro, motors and down range, here are {len(paths)}; simulator as it is")
    with bar("reading again") as report:
        recorded = recorded_flights.read(paths, speed_mps=speed_mps,
                                         progress=lambda done, total: report(done, total, ""))
    out = work / f"twin_{key(recorded, vehicle, flights=BATCH, seed=seed)}"
    calibrate(recorded, vehicle, out, rounds=ROUNDS, flights=BATCH, seed=seed, bar=bar)
    return Twin(scenario.load(out / files.SCENARIO), vehicles.load(str(out / files.VEHICLE)),
                f"twin fitted to {len(recorded.courses)} of them")


def calibrate(recorded: RecordedFlights, vehicle: Vehicle, out: Path, *, rounds: int, flights: int, seed: int,
              bar: Bars, workers: int | None = None) -> Calibration:
    """Fit a twin and write vehicle.toml, scenario.toml and fit.json to a folder. The same arguments give the same twin.

    rounds, flights: as of `fit.fit`. workers: threads, by default one for each core. Finished rounds are in fit.json,
    so that the same call continues after a stop. Raises AirTouchError if fit.json is a fit of other flights or
    settings.
    """
    make_folder(out)
    workers = workers or available_cores()
    target, levers, fit_key = _request(recorded, vehicle, flights, seed)
    with bar("fitting") as report:
        state = fit.fit(target, vehicle, levers, rounds=rounds, flights=flights, seed=seed, workers=workers,
                        fixed=lever_set.FIXED, state_file=out / FIT,
                        progress=lambda done, total, now: report(done, total, f"misfit {fit.total(now):.2f}"))
    if state.refined is None:
        with bar("edges") as report:
            state.refined = edge_fit.refine(
                target, vehicle, levers, fit.best(state), flights=edge_fit.flights_for(flights), seed=seed,
                workers=workers, fixed=lever_set.FIXED, progress=lambda done, total: report(done, total, "")).values
        fit.save(out / FIT, state, fit_key)
    files.write(out, vehicle, levers, state.refined, recorded.courses, lever_set.FIXED, force=True)
    return Calibration(target, levers, state.refined, state.history)


def key(recorded: RecordedFlights, vehicle: Vehicle, *, flights: int, seed: int) -> str:
    """Hash, of twelve digits, of the flights, the vehicle and the settings of a fit."""
    return _request(recorded, vehicle, flights, seed)[2]


def _request(recorded: RecordedFlights, vehicle: Vehicle, flights: int, seed: int,
             ) -> tuple[Target, tuple[Lever, ...], str]:
    """Target, levers and key of the fit that these arguments ask for."""
    target = fit.target_of(recorded.courses, recorded.features)
    levers = lever_set.default(vehicle, recorded.near)
    return target, levers, fit.key(target, vehicle, levers, flights=flights, seed=seed, fixed=lever_set.FIXED)


def in_words(misfit: dict[str, float]) -> str:
    """The misfit of each group, in scatters, as text."""
    return ", ".join(f"{name} {value:.2f}" for name, value in misfit.items())
