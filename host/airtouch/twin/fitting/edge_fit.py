"""Last stage of a fit: the levers that act at edges, by paired simulated flights.

The rounds of `fit` draw all levers at once, and few of the flights are high ones: their edges hardly enter. Here each
lever is moved alone, with the same courses and random numbers, as many high flights as low ones. The difference of two
such flights is what the lever does, nearly without noise (common random numbers; Glasserman, Monte Carlo Methods in
Financial Engineering, 2003, chapter 7). Gauss-Newton steps follow; a step counts only if the misfit falls.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from airtouch.twin.fitting import fit, fly
from airtouch.twin.fitting import levers as lever_set
from airtouch.twin.fitting.fit import Target
from airtouch.twin.fitting.levers import Lever
from airtouch.twin.recorded.course import Course
from airtouch.twin.recorded.features import CLASSES, height_class
from airtouch.vehicle import Vehicle

#: effects whose levers are fitted here; motors and their delay enter each response to an edge
EFFECTS = ("ground_effect", "flow_scale", "flow_latency", "range_bias", "range_step", "motor_lag", "actuator_delay")
FLIGHTS = 60  #: simulated flights of each comparison; no source: round number, 20 of each height class
BATCH = 160  #: flights of a round to which FLIGHTS belongs
STEPS = 4  #: Gauss-Newton steps; no source: round number
SHRINK = 0.5  #: factor of the steps after one that raised the misfit; no source: the usual bisection
FIRST_NUMBER = 500_000  #: number of the first flight; larger than that of any flight of the rounds


@dataclass(frozen=True)
class EdgeFit:
    """A fit: values (levers,), and the cost before each step and after the last (weighted squared misfits)."""

    values: np.ndarray
    misfit: list[float]


def refine(target: Target, vehicle: Vehicle, levers: Sequence[Lever], values: np.ndarray, *, seed: int = 0,
           fixed: Mapping[str, Any] | None = None, workers: int = 1, flights: int = FLIGHTS,
           progress: Callable[[int, int], None] = lambda *_: None) -> EdgeFit:
    """Fit the levers of EFFECTS to the recorded edges. The same arguments give the same result.

    values: (levers,) to start from. fixed: effects without levers. progress: as progress(comparisons, all). The cost is
    that of `fit.best`, on `flights` flights that all comparisons share.
    """
    edge_indices = [k for k, lever in enumerate(levers) if lever.of in EFFECTS]
    edge_levers = [levers[k] for k in edge_indices]
    steps = np.array([lever.step for lever in edge_levers])
    chosen = balanced_draw(target.courses, flights, np.random.default_rng([seed, 17]))
    total = 1 + len(edge_indices) + STEPS
    comparisons = 0

    def difference(trial: np.ndarray) -> np.ndarray:
        """Simulated minus recorded features (flights, features), in scatters."""
        nonlocal comparisons
        simulated = fly.simulated_features([target.courses[i] for i in chosen], vehicle, levers,
                                           np.tile(trial, (len(chosen), 1)), seed, FIRST_NUMBER, fixed, workers)
        progress(comparisons := comparisons + 1, total)
        return target.differences(simulated, chosen)

    values = lever_set.clip(levers, values)
    present = difference(values)
    jacobian = np.column_stack([
        _mean(difference(_step(values, k, levers[k])) - present) / _sign(values[k], levers[k])
        for k in edge_indices])
    history = [_cost(_mean(present))]
    factor = 1.0
    for _ in range(STEPS):
        variance = _variance(present) + 1.0 / target.counts
        step = factor * fit.least_squares_step(np.nan_to_num(jacobian), _mean(present), variance, edge_levers,
                                               values[edge_indices], steps)
        trial = values.copy()
        trial[edge_indices] += steps * step
        trial = lever_set.clip(levers, trial)
        trial_difference = difference(trial)
        history.append(_cost(_mean(trial_difference)))
        if history[-1] < min(history[:-1]):
            values, present = trial, trial_difference
        else:
            factor *= SHRINK
    return EdgeFit(values, history)


def flights_for(batch: int) -> int:
    """Flights of a comparison, in proportion to the `batch` flights of a round: FLIGHTS for BATCH."""
    return FLIGHTS * batch // BATCH


def balanced_draw(courses: Sequence[Course], count: int, rng: np.random.Generator) -> np.ndarray:
    """Numbers of courses, (count,), with equal numbers of each height class and of each course within a class."""
    height = [height_class(c.clearance_m) for c in courses]
    classes = [rng.permutation([i for i, h in enumerate(height) if h == name]) for name in CLASSES if name in height]
    classes = classes or [np.arange(len(courses))]
    turns = [(classes[n % len(classes)], n // len(classes)) for n in range(count)]
    return np.array([group[n % len(group)] for group, n in turns])


def _sign(value: float, lever: Lever) -> float:
    """The direction in which a lever is moved: 1, or -1 if 1 is out of bounds."""
    return 1.0 if value + lever.step <= lever.high else -1.0


def _step(values: np.ndarray, k: int, lever: Lever) -> np.ndarray:
    """The values (levers,) with lever k one step further."""
    out = values.copy()
    out[k] += _sign(values[k], lever) * lever.step
    return out


def _mean(values: np.ndarray) -> np.ndarray:
    """Mean (features,) over flights, NaN where fewer than `fit.MIN_FLIGHTS` have the feature."""
    count = np.isfinite(values).sum(axis=0)
    return np.where(count >= fit.MIN_FLIGHTS, np.nansum(values, axis=0) / np.maximum(count, 1), np.nan)


def _variance(values: np.ndarray) -> np.ndarray:
    """Variance (features,) of `_mean`."""
    count = np.isfinite(values).sum(axis=0)
    squares = np.nansum((values - _mean(values)) ** 2, axis=0)
    return np.where(count >= fit.MIN_FLIGHTS, squares / np.maximum(count, 1) ** 2, np.nan)


def _cost(mean: np.ndarray) -> float:
    """Weighted sum of squared misfits of mean differences (features,)."""
    return fit.total(fit.misfit(mean)) ** 2
