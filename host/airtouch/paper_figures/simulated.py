"""Flights of the simulator and their scores, where no recorded flight has the paper's condition."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.detector import registry
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.dataset import Condition, FlightFile
from airtouch.detector.evaluation.score import FlightScore
from airtouch.errors import AirTouchError
from airtouch.logs.edges import Edge
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import batch, scenario
from airtouch.simulation.flight import Diverged

SEED = 9  #: of every batch of flights here; any other would do
SPARE = 2  #: flights tried for each one wanted, at most
Effects = tuple[tuple[str, tuple[tuple[str, float], ...]], ...]  #: name and parameters, hashable


@cache
def flown(name: str, count: int, effects: Effects = (), seed: int = SEED) -> tuple[FlightLog, ...]:
    """The first `count` flights of a built-in scenario that end well; effects on top of the scenario's.

    Raises AirTouchError where too few do.
    """
    chosen = [(effect, dict(values)) for effect, values in effects]
    kept: list[FlightLog] = []
    for flight in batch.flights(name, range(SPARE * count), effects=chosen, seed=seed):
        if not isinstance(flight, Diverged):
            kept.append(flight)
        if len(kept) == count:
            return tuple(kept)
    raise AirTouchError(f"{name}: only {len(kept)} of {SPARE * count} simulated flights ended well")


def scores(flights: Sequence[FlightLog], detector: str, model: Any = None) -> list[FlightScore]:
    """One score a flight, edges told by the log's down range; model None: the shipped one."""
    chosen = registry.get(detector)
    model = chosen.load(None) if model is None else model
    return [evaluate.evaluate_flight(FlightFile(Path(log.source), condition(log)), log, chosen, model).score
            for log in flights]


def condition(log: FlightLog) -> Condition:
    """Speed and angle of a simulated flight."""
    drawn = log.meta["condition"]
    return Condition(speed_mps=drawn["speed"], angle_deg=drawn.get("angle"))


def crossings(log: FlightLog) -> list[Edge]:
    """Edges by the drone's true place: the samples at which it passes the platform's front and back in x.

    For platforms of the height of the floor, which the down range cannot tell. Tilted platforms count by where the
    drone is, y included.
    """
    plan = scenario.draw_flight(scenario.load(log.meta["scenario"]), log.meta["seed"], log.meta["flight"])
    over = inside(plan.world.corners[plan.world.first[0]:plan.world.first[1]], log["x_m"], log["y_m"])
    steps = np.flatnonzero(np.diff(over.astype(int))) + 1
    return [Edge(int(s), "entry" if over[s] else "exit", np.nan, np.nan) for s in steps]


def inside(corners: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n,) whether places lie in a convex polygon, corners (k, 2) anticlockwise."""
    ahead = np.roll(corners, -1, axis=0) - corners
    side = [ahead[i, 0] * (y - corners[i, 1]) - ahead[i, 1] * (x - corners[i, 0]) for i in range(len(corners))]
    return np.all(np.array(side) >= 0.0, axis=0)


def labelled(log: FlightLog, edges: Callable[[FlightLog], list[Edge]] = crossings) -> FlightLog:
    """The log with a down range that steps by 1 m at each edge: truth for training and scoring, never an input."""
    over = np.zeros(len(log), bool)
    for edge in edges(log):
        over[edge.sample:] = edge.kind == "entry"
    return replace(log, columns={**log.columns, "zrange_m": np.where(over, 0.04, 1.04)})
