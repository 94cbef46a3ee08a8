"""Many flights: deterministic per seed whatever the number of workers, bounded memory."""

import os
from collections.abc import Iterable, Iterator, Sequence, Sized
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import effects as registry
from airtouch.simulation import scenario as scenarios
from airtouch.simulation.flight import Chosen, Diverged, fly
from airtouch.simulation.scenario import Scenario
from airtouch.simulation.workers.in_order import in_order
from airtouch.vehicle import Vehicle

AHEAD = 4  #: flights in work or waiting, for each worker


def flights(scenario: Scenario | str | Path, count: int | Iterable[int], *,
            vehicle: Vehicle | str | Path | None = None,
            effects: Chosen = (), without: Sequence[str] = (), seed: int = 0,
            workers: int | None = None) -> Iterator[FlightLog | Diverged]:
    """Fly and yield flights one by one, in order; at most AHEAD per worker are held in memory.

    scenario, vehicle: objects, built-in names or .toml paths. count: how many flights, or
    their numbers. A flight depends on (scenario, vehicle, effects, without, seed, its
    number) only. workers: threads (the loop runs outside Python's lock); default one a core.
    Raises AirTouchError for bad input at the call, before the first flight; for a wrong number that an iterator
    yields, when it comes.
    """
    scene = scenario if isinstance(scenario, Scenario) else scenarios.load(scenario)
    craft = vehicle if isinstance(vehicle, Vehicle) else vehicles.load(vehicle or vehicles.DEFAULT_VEHICLE)
    if not isinstance(count, Iterable) or getattr(count, "ndim", 1) == 0:  # NumPy's array of one number has no items
        count = range(_whole(count, "the number of flights"))
    elif isinstance(count, Sized):
        for number in count:
            _whole(number, "a flight's number")
    numbers = (_whole(number, "a flight's number") for number in count)
    seed = _whole(seed, "seed")
    workers = available_cores() if workers is None else _whole(workers, "workers", 1)
    effects = registry.activate(effects)
    without = registry.names_of(without)

    def one(number: int) -> FlightLog | Diverged:
        return fly(scene, craft, seed, number, effects=effects, without=without)

    return _in_order(one, numbers, workers)


def _whole(value: object, name: str, least: int = 0) -> int:
    """The value as an int. Raises AirTouchError for one that is no whole number or is less than `least`."""
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < least:
        raise AirTouchError(f"{name} must be a whole number, {least} or more, not {value!r}")
    return int(value)


def _in_order(one, numbers: Iterator[int], workers: int) -> Iterator[FlightLog | Diverged]:
    if workers == 1:
        yield from map(one, numbers)
        return
    with ThreadPoolExecutor(workers) as pool:
        yield from in_order(partial(pool.submit, one), numbers, AHEAD * workers)


def simulate(scenario: Scenario | str | Path, vehicle: Vehicle | str | Path | None = None,
             effects: Chosen = (),
             seeds: int | Iterable[int] = 1, *, without: Sequence[str] = (), seed: int = 0,
             workers: int | None = None) -> list[FlightLog]:
    """Fly `seeds` flights of a batch (how many, or their numbers; not seeds) and return their logs.

    seed: of the whole batch; the others as of `flights`. Raises AirTouchError that names the first flight that does
    not end well.
    """
    logs = []
    for result in flights(scenario, seeds, vehicle=vehicle, effects=effects, without=without, seed=seed,
                          workers=workers):
        if isinstance(result, Diverged):
            raise AirTouchError(str(result))
        logs.append(result)
    return logs


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
