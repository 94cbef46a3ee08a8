"""Fit of mean effects by Gauss-Newton on the whitened spectra, the offsets between flights beside them."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.least_squares import Bounds, bounded_step, bounds_of, normal_equations, weights_of
from airtouch.gap.evidence.problem import Problem
from airtouch.gap.evidence.slopes import SpectraSlopes, active_at, slopes_at
from airtouch.gap.signatures.term import Term, mean_places

ITERATIONS = 8  #: most steps; chosen for time. A smaller number ends more fits before they stand still
#: nats that a step must gain for the fit to go on; chosen for time. A larger number ends fits too early
LEAST_STEP_GAIN = 0.02
#: attempts at a step, each shorter than the one before (Levenberg-Marquardt); chosen for time. With a smaller number
#: more steps fail
TRIES = 5
DAMPING_FACTOR = 0.1  #: on the damping after a step that gained; its inverse after an attempt that failed; chosen
#: damping after the first attempt that failed, 0.1 but for its last bit; chosen. A larger number makes shorter steps
FIRST_DAMPING = 0.01 / DAMPING_FACTOR
ROUNDING = 1e-9  #: nats that a step must gain at least, above what rounding may gain; chosen
#: standard deviation, natural steps, of the prior of parameters that only the commands show; chosen. A larger number
#: holds them back less
COMMAND_PRIOR = 1.5
NEAR_NEUTRAL = 0.05  #: scaled parameter at which a new effect begins, as some have no slope at neutral itself; chosen
#: scaled parameters at which effects of the loop may begin; chosen. With fewer a fit may end at a lower peak
GRID = (-2.0, -1.0, -0.5, 0.05, 0.5, 1.0, 1.5, 2.0, 3.0)


class MeanFit(NamedTuple):
    """Scaled parameters x (k,), the covariance (k, k) where the last step began, and the gap (n,) that they leave."""

    x: np.ndarray
    covariance: np.ndarray
    values: np.ndarray


class _State(NamedTuple):
    """Where a fit stands: parameters, offsets, gap (n,), power (n,) over the floor, minus the log posterior."""

    x: np.ndarray
    offsets: np.ndarray
    values: np.ndarray
    power: np.ndarray
    cost: float


class Posterior:
    """Posterior of mean effects' parameters beside random effects that stay as they are.

    extra_power (n,): that of the random effects; uncertain_floor: whether the commands' floor is as uncertain as under
    such; spread: standard deviation of the parameters' prior; prior (k + m,): of parameters and offsets.
    """

    def __init__(self, problem: Problem, mean: Sequence[Term], extra_power: np.ndarray | float,
                 spread: np.ndarray | float, uncertain_floor: bool) -> None:
        self.problem, self.mean = problem, mean
        self.extra_power, self.uncertain_floor = extra_power, uncertain_floor
        of_loop = np.array([t.signature.loop_only for t in mean for _ in t.free], bool)
        spreads = np.where(of_loop, np.minimum(spread, COMMAND_PRIOR), spread)
        self.prior = np.concatenate([spreads, [o.spread for o in problem.offsets]])

    def at(self, x: np.ndarray, offsets: np.ndarray) -> _State:
        """The state at parameters x (k,) and offsets (m,)."""
        active = active_at(self.mean, x)
        values = self.problem.values(active) if self.mean else self.problem.elements.base.copy()
        for amount, (places, column, _) in zip(offsets, self.problem.offsets, strict=True):
            values[places] -= amount * column
        of_loop = self.problem.loop_power(active, self.uncertain_floor)
        power = self.extra_power + of_loop.power
        away = float(((np.concatenate([x, offsets]) / self.prior) ** 2).sum())
        return _State(x, offsets, values, power, of_loop.cost + (0.5 * away - self.problem.likelihood(values, power)))


class _Step(NamedTuple):
    """The state after a step, the parameters' covariance, the damping for the next, and whether the step gained."""

    state: _State
    covariance: np.ndarray
    damping: float
    gained: bool


def gauss_newton(posterior: Posterior, x: np.ndarray, most: int = ITERATIONS) -> MeanFit:
    """Mean effects of highest posterior, from scaled parameters x (k,) on, in `most` steps at most.

    The slopes are kept from step to step, as most effects are close to linear. They are taken anew after a step that
    failed, or that ended far from where they were taken. The fit ends with a step that gains less than LEAST_STEP_GAIN,
    or that fails with slopes taken where it began.
    """
    problem, mean = posterior.problem, posterior.mean
    bounds = bounds_of(mean)
    x, offsets, covariance = np.clip(x, *bounds), np.zeros(len(problem.offsets)), np.zeros((len(x), len(x)))
    if not mean and not problem.offsets:
        return MeanFit(x, covariance, problem.elements.base)
    now = posterior.at(x, offsets)
    slopes: SpectraSlopes | None = None
    stuck, damping = False, 0.0
    for _ in range(most):
        slopes = slopes_at(problem, mean, now.x) if slopes is None else slopes.moved_to(now.x, stuck)
        before = now.cost
        now, covariance, damping, gained = _step(posterior, slopes, now, bounds, damping)
        slopes_are_new = stuck or np.array_equal(now.x, slopes.at)
        if slopes_are_new if not gained else before - now.cost < LEAST_STEP_GAIN:
            break
        stuck = not gained
    return MeanFit(now.x, covariance, now.values)


def _step(posterior: Posterior, slopes: SpectraSlopes, now: _State, bounds: Bounds, damping: float) -> _Step:
    """A step, shortened until it gains, TRIES times at most."""
    problem, size = posterior.problem, len(now.x)
    equations = normal_equations([s.column for s in slopes.by_parameter], posterior.prior, now.values,
                                 weights_of(problem, now.values, now.power), np.concatenate([now.x, now.offsets]),
                                 problem.offsets)
    equations = equations.with_power(slopes.power_slopes(now.x, now.values, now.power, posterior.uncertain_floor))
    for _ in range(TRIES):
        change, covariance = bounded_step(equations, now.x, bounds, damping)
        new = posterior.at(np.clip(now.x + change[:size], *bounds), now.offsets + change[size:])
        if new.cost < now.cost - ROUNDING:
            return _Step(new, covariance, damping * DAMPING_FACTOR, True)
        damping = max(damping / DAMPING_FACTOR, FIRST_DAMPING)
    return _Step(now, covariance, damping, False)


def start_of(problem: Problem, mean: Sequence[Term], start: np.ndarray | None) -> np.ndarray:
    """Scaled parameters (k,) at which a fit begins: those of `start`, close to neutral where it is NaN.

    Effects of the loop without a start begin where their likelihood is highest on a coarse grid.
    """
    size = sum(len(t.free) for t in mean)
    start = np.full(size, np.nan) if start is None else start
    x = np.where(np.isnan(start), NEAR_NEUTRAL, start)
    for t, place in mean_places(mean):
        if t.signature.loop_only and len(problem.flat.commands) and np.isnan(start[place]).all():
            x = _best_on_grid(problem, mean, x, range(place.start, place.stop))
    return x


def _best_on_grid(problem: Problem, mean: Sequence[Term], x: np.ndarray, place: range) -> np.ndarray:
    """The parameters (k,) with that one of an effect's (`place`) moved to that entry of GRID that is likeliest."""
    low, high = bounds_of(mean)
    best, out = -np.inf, x
    for i, amount in itertools.product(place, GRID):
        trial = x.copy()
        trial[i] = np.clip(amount, low[i], high[i])
        of_loop = problem.loop_power(active_at(mean, trial))
        level = problem.likelihood(problem.elements.base, of_loop.power) - of_loop.cost
        if level > best:
            best, out = level, trial
    return out
