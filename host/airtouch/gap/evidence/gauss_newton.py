"""Fit of mean effects by Gauss-Newton on the whitened residual, the offsets between flights beside them.

A step that does not gain is shortened by damping (Levenberg 1944, Quart. Appl. Math. 2, 164; Marquardt 1963, J. SIAM
11, 431): the normal matrix gets `damping` times its own diagonal on top.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.least_squares import Bounds, bounded_step, bounds_of, normal_equations, weights_of
from airtouch.gap.evidence.problem import Problem
from airtouch.gap.evidence.slopes import SpectraSlopes, active_at, slopes_at
from airtouch.gap.signatures.term import Term, mean_slices
from airtouch.simulation.effects import Active

MOST_STEPS = 8  #: steps at most; chosen for time. A smaller number ends more fits before they stand still
#: nats that a step must gain for the fit to go on; chosen for time. A larger number ends fits too early
LEAST_STEP_GAIN = 0.02
#: nats that a step must promise to be tried, to second order; chosen for time. With ten times as many fits end too
#: early
LEAST_PROMISE = 0.1 * LEAST_STEP_GAIN
#: attempts at a step, each with more damping than the last; chosen for time. With a smaller number more steps fail
MOST_ATTEMPTS = 5
#: factor on the damping after a step that gained; its inverse after an attempt that failed; chosen. A smaller one
#: changes the damping faster
DAMPING_FACTOR = 0.1
#: damping, a fraction of the diagonal, from which it grows at least: a first attempt has none, and the second has
#: LEAST_DAMPING / DAMPING_FACTOR = 0.1, which divides a step in one parameter by 1.1; chosen. A larger number makes
#: shorter steps
LEAST_DAMPING = 0.01
ROUNDING_GAIN = 1e-9  #: nats that a step must gain at least, above what rounding may gain; chosen
#: standard deviation, natural steps, of the prior of parameters that only the commands show; chosen. A larger number
#: holds them back less
COMMAND_PRIOR_STD = 1.5
NEAR_NEUTRAL = 0.05  #: scaled parameter at which a new effect begins, as some have no slope at neutral itself; chosen
#: scaled parameters at which effects of the loop may begin; chosen. With fewer a fit may end at a lower peak
LOOP_STARTS = (-2.0, -1.0, -0.5, 0.05, 0.5, 1.0, 1.5, 2.0, 3.0)


class MeanFit(NamedTuple):
    """Scaled parameters x (k,), their covariance (k, k) where the last step began; offsets (m,), residual (n,) at x."""

    x: np.ndarray
    covariance: np.ndarray
    offsets: np.ndarray
    residual: np.ndarray


class _Point(NamedTuple):
    """A point of the posterior: parameters (k,), offsets (m,), residual (n,), extra power (n,), minus its log, nats."""

    x: np.ndarray
    offsets: np.ndarray
    residual: np.ndarray
    extra_power: np.ndarray
    cost: float


class Posterior:
    """Posterior of mean effects' parameters beside random effects that stay as they are.

    random_power (n,): extra power of the random effects; random: these, as far as the loop answers them too; prior_std:
    standard deviation of the parameters' prior, (k,) or one for all; uncertain_floor: whether the commands' floor is as
    uncertain as under random effects. The attribute `prior_stds` (k + m,) is that of parameters and offsets.
    """

    def __init__(self, problem: Problem, mean: Sequence[Term], random_power: np.ndarray | float,
                 prior_std: np.ndarray | float, uncertain_floor: bool, random: Sequence[Active] = ()) -> None:
        self.problem, self.mean, self.random = problem, mean, random
        self.random_power, self.uncertain_floor = random_power, uncertain_floor
        of_loop = np.array([t.signature.loop_only for t in mean for _ in t.free], bool)
        of_parameters = np.where(of_loop, np.minimum(prior_std, COMMAND_PRIOR_STD), prior_std)
        self.prior_stds = np.concatenate([of_parameters, [o.prior_std for o in problem.offsets]])

    def at(self, x: np.ndarray, offsets: np.ndarray) -> _Point:
        """The point at parameters x (k,) and offsets (m,)."""
        active = active_at(self.mean, x)
        residual = self.problem.residual(active) if self.mean else self.problem.elements.residual.copy()
        for amount, (indices, column, _) in zip(offsets, self.problem.offsets, strict=True):
            residual[indices] -= amount * column
        of_loop = self.problem.loop_change([*active, *self.random], self.uncertain_floor)
        extra = self.random_power + of_loop.extra_power
        away = float(((np.concatenate([x, offsets]) / self.prior_stds) ** 2).sum())
        cost = of_loop.cost + (0.5 * away - self.problem.likelihood(residual, extra))
        return _Point(x, offsets, residual, extra, cost)


class _Step(NamedTuple):
    """The point after a step, the parameters' covariance, the damping for the next, and whether the step gained."""

    point: _Point
    covariance: np.ndarray
    damping: float
    gained: bool


def gauss_newton(posterior: Posterior, x: np.ndarray, most: int = MOST_STEPS,
                 offsets: np.ndarray | None = None) -> MeanFit:
    """Mean effects of highest posterior, from scaled parameters x (k,) on, in `most` steps at most.

    offsets (m,): at which the fit begins, 0 by default. No step lowers the posterior. The slopes are kept from step to
    step, as most effects are close to linear. They are taken anew after a step that failed, or that ended far from
    where they were taken. The fit ends with a step that gains less than LEAST_STEP_GAIN, or that fails with slopes
    taken where it began.
    """
    problem, mean = posterior.problem, posterior.mean
    bounds = bounds_of(mean)
    x, covariance = np.clip(x, *bounds), np.zeros((len(x), len(x)))
    offsets = np.zeros(len(problem.offsets)) if offsets is None else offsets
    if not mean and not problem.offsets:
        return MeanFit(x, covariance, offsets, problem.elements.residual)
    now = posterior.at(x, offsets)
    slopes: SpectraSlopes | None = None
    stuck, damping = False, 0.0
    for _ in range(most):
        slopes = slopes.moved_to(now.x, stuck) if slopes else slopes_at(problem, mean, now.x, posterior.random)
        before = now.cost
        now, covariance, damping, gained = _step(posterior, slopes, now, bounds, damping)
        gained_too_little = gained and before - now.cost < LEAST_STEP_GAIN
        failed_with_new_slopes = not gained and (stuck or np.array_equal(now.x, slopes.at))
        if gained_too_little or failed_with_new_slopes:
            break
        stuck = not gained
    return MeanFit(now.x, covariance, now.offsets, now.residual)


def _step(posterior: Posterior, slopes: SpectraSlopes, now: _Point, bounds: Bounds, damping: float) -> _Step:
    """A step from the point `now`, shortened until it gains, or promises less than LEAST_PROMISE.

    It has MOST_ATTEMPTS attempts at most.
    """
    problem, k = posterior.problem, len(now.x)
    weights = weights_of(problem, now.residual, now.extra_power)
    equations = normal_equations([s.column for s in slopes.by_parameter], posterior.prior_stds, now.residual, weights,
                                 np.concatenate([now.x, now.offsets]), problem.offsets)
    by_power = slopes.power_slopes(now.x, now.residual, now.extra_power, posterior.uncertain_floor)
    equations = equations.with_power(by_power)
    for _ in range(MOST_ATTEMPTS):
        change, covariance = bounded_step(equations, now.x, bounds, damping)
        if equations.gain_of(change) < LEAST_PROMISE:
            break
        new = posterior.at(np.clip(now.x + change[:k], *bounds), now.offsets + change[k:])
        if new.cost < now.cost - ROUNDING_GAIN:
            return _Step(new, covariance, damping * DAMPING_FACTOR, True)
        damping = max(damping, LEAST_DAMPING) / DAMPING_FACTOR
    return _Step(now, covariance, damping, False)


def start_of(problem: Problem, mean: Sequence[Term], start: np.ndarray | None) -> np.ndarray:
    """Scaled parameters (k,) at which a fit begins: those of `start`, close to neutral where it is NaN.

    Effects of the loop without a start begin where their likelihood is highest on a coarse grid.
    """
    size = sum(len(t.free) for t in mean)
    start = np.full(size, np.nan) if start is None else start
    x = np.where(np.isnan(start), NEAR_NEUTRAL, start)
    for t, own in mean_slices(mean):
        if t.signature.loop_only and len(problem.flat.commands) and np.isnan(start[own]).all():
            x = _best_on_grid(problem, mean, x, range(own.start, own.stop))
    return x


def _best_on_grid(problem: Problem, mean: Sequence[Term], x: np.ndarray, own: range) -> np.ndarray:
    """The parameters (k,) with one of an effect's own moved to an entry of LOOP_STARTS, the best of all such moves.

    The residual stays that without effects: a move counts by the expected power and by the cost of the floor alone.
    """
    low, high = bounds_of(mean)
    best, out = -np.inf, x
    for i, amount in itertools.product(own, LOOP_STARTS):
        trial = x.copy()
        trial[i] = np.clip(amount, low[i], high[i])
        of_loop = problem.loop_change(active_at(mean, trial))
        level = problem.likelihood(problem.elements.residual, of_loop.extra_power) - of_loop.cost
        if level > best:
            best, out = level, trial
    return out
