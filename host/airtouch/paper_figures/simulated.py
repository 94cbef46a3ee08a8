"""Simulated flights and their scores, for conditions of the paper without recorded flights."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.detector import registry
from airtouch.detector.evaluation import evaluate
from airtouch.detector.evaluation.data.dataset import Condition, FlightFile
from airtouch.detector.evaluation.score import FlightScore
from airtouch.errors import AirTouchError
from airtouch.logs.edges import Edge
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import batch, scenario
from airtouch.simulation.flight import Diverged
from airtouch.simulation.flight_plan import world

SEED = 9  #: seed of every batch of flights here; arbitrary
SPARE = 2  #: most flights simulated for each one returned; the rest diverged
Effects = tuple[tuple[str, tuple[tuple[str, float], ...]], ...]  #: name and parameters, hashable


@cache
def flights(name: str, count: int, effects: Effects = (), seed: int = SEED) -> tuple[FlightLog, ...]:
    """The first `count` flights of a built-in scenario that do not diverge. effects: added to the scenario's.

    Raises AirTouchError if too many diverge.
    """
    added = [(effect, dict(values)) for effect, values in effects]
    logs: list[FlightLog] = []
    for flight in batch.flights(name, range(SPARE * count), effects=added, seed=seed):
        if not isinstance(flight, Diverged):
            logs.append(flight)
        if len(logs) == count:
            return tuple(logs)
    raise AirTouchError(f"{name}: only {len(logs)} of {SPARE * count} simulated flights ended well")


def scores(logs: Sequence[FlightLog], detector: str, model: Any = None) -> list[FlightScore]:
    """One score for each flight. True edges come from the down range. model: None for the shipped one."""
    runner = registry.get(detector)
    model = runner.load(None) if model is None else model
    return [evaluate.evaluate_flight(FlightFile(Path(log.source), condition(log)), log, runner, model).score
            for log in logs]


def condition(log: FlightLog) -> Condition:
    """The condition, speed and angle, of a simulated flight."""
    drawn = log.meta["condition"]
    return Condition(speed_mps=drawn["speed"], angle_deg=drawn.get("angle"))


def crossings(log: FlightLog) -> list[Edge]:
    """True edges by the drone's true position: the samples at which it crosses the platform's front and back in x.

    For platforms level with the floor, which the down range does not show. On a rotated platform y counts too.
    """
    plan = scenario.draw_flight(scenario.load(log.meta["scenario"]), log.meta["seed"], log.meta["flight"])
    over = world.inside(plan.world.corners[plan.world.first[0]:plan.world.first[1]], log["x_m"], log["y_m"])
    steps = np.flatnonzero(np.diff(over.astype(int))) + 1
    return [Edge(int(s), "entry" if over[s] else "exit", np.nan, np.nan) for s in steps]


def with_truth(log: FlightLog, edges: Callable[[FlightLog], list[Edge]] = crossings) -> FlightLog:
    """The log with a down range that steps by 1 m at each edge, as ground truth for training and scoring."""
    over = np.zeros(len(log), bool)
    for edge in edges(log):
        over[edge.sample:] = edge.kind == "entry"
    return replace(log, columns={**log.columns, "zrange_m": np.where(over, 0.04, 1.04)})
