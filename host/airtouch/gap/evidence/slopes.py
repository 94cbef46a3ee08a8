"""Slopes of the residual by the parameters of mean effects, for the steps of a fit."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.least_squares import bounds_of
from airtouch.gap.evidence.problem import Problem
from airtouch.gap.evidence.torque_power import loops_differ
from airtouch.gap.signals.command_view import LikelihoodSlopes
from airtouch.gap.signatures.term import Term, mean_slices
from airtouch.simulation.effects import Active

#: change of a scaled parameter over which slopes are taken; chosen. A larger number sees more of the curvature as
#: slope, a smaller one more of the rounding
SLOPE_STEP = 0.02
#: change of a scaled parameter, of its size or of 1, over which slopes are taken anew; chosen for time. A larger number
#: keeps slopes that no longer hold, so that steps fail and the fit takes more of them
LARGEST_MOVE = 0.3


def active_at(mean: Sequence[Term], x: np.ndarray) -> list[Active]:
    """Mean effects at scaled parameters x (k,), without those that are neutral there."""
    return [t.active(x[own]) for t, own in mean_slices(mean) if x[own].any() or t.acts_when_neutral]


class ParameterSlopes(NamedTuple):
    """Change per natural step of one parameter.

    column, complex (n,): of the residual; rise (bins, axes): of the logarithm of the commands' expected power;
    extra_torque_power (replay,): of the torque; nonlinear: whether the parameter changes the control loop, so that the
    residual is no linear function of it.
    """

    column: np.ndarray
    rise: np.ndarray
    extra_torque_power: np.ndarray
    nonlinear: bool


@dataclass(frozen=True, eq=False)
class SpectraSlopes:
    """First-order changes of the residual of `problem` by the k parameters of mean effects.

    at (k,): scaled parameters at which all slopes were last taken; nonlinear ones may be newer.
    by_parameter: k of them; random: random effects beside them, which stay as they are.
    """

    problem: Problem
    mean: Sequence[Term]
    at: np.ndarray
    by_parameter: Sequence[ParameterSlopes]
    random: Sequence[Active] = ()

    def moved_to(self, x: np.ndarray, anew: bool = False) -> "SpectraSlopes":
        """The slopes for scaled parameters x (k,), where those of nonlinear parameters are taken anew.

        All are where x is farther than LARGEST_MOVE from `at`, or if `anew`.
        """
        if anew or bool((np.abs(x - self.at) > LARGEST_MOVE * np.maximum(np.abs(x), 1.0)).any()):
            return slopes_at(self.problem, self.mean, x, self.random)
        stale = [i for i, s in enumerate(self.by_parameter) if s.nonlinear]
        newer = dict(zip(stale, _slopes_of(self.problem, self.mean, x, stale, self.random), strict=True))
        return replace(self, by_parameter=[newer.get(i, s) for i, s in enumerate(self.by_parameter)])

    def power_slopes(self, x: np.ndarray, residual: np.ndarray, extra_power: np.ndarray | float,
                     uncertain_floor: bool) -> LikelihoodSlopes:
        """Slopes of the log likelihood by the k parameters, as far as these change the expected power.

        x (k,): the scaled parameters; residual (n,); extra_power (n,): what all effects add to the floor's;
        uncertain_floor: see `Problem.modelled`.
        """
        problem = self.problem
        active, rises = [*active_at(self.mean, x), *self.random], np.array([s.rise for s in self.by_parameter])
        slopes = problem.flat.commands.slopes(active, rises, uncertain_floor)
        powers = np.array([s.extra_torque_power for s in self.by_parameter])
        if powers.any():
            by_power = problem.likelihood.power_slopes(residual, np.broadcast_to(extra_power, residual.shape),
                                                       problem.flat.replay_count)
            slopes = LikelihoodSlopes(slopes.gradient + powers @ by_power.slope,
                                      slopes.information + (powers * by_power.curvature) @ powers.T)
        return slopes


def slopes_at(problem: Problem, mean: Sequence[Term], x: np.ndarray, random: Sequence[Active] = ()) -> SpectraSlopes:
    """The slopes by all parameters of mean effects at scaled ones x (k,), beside random effects."""
    return SpectraSlopes(problem, mean, x.copy(), _slopes_of(problem, mean, x, range(len(x)), random), random)


def _slopes_of(problem: Problem, mean: Sequence[Term], x: np.ndarray, which: Sequence[int],
               random: Sequence[Active]) -> list[ParameterSlopes]:
    """The slopes by some of the parameters at scaled parameters x (k,), beside random effects.

    They are differences over SLOPE_STEP, within the bounds. which: indices of the parameters.
    """
    if not which:
        return []
    high = bounds_of(mean).high
    before = active_at(mean, x)
    residual, extra_torque_power = problem.residual(before), problem.extra_torque_power([*before, *random])
    out = []
    for i in which:
        step = SLOPE_STEP if x[i] + SLOPE_STEP <= high[i] else -SLOPE_STEP
        shifted = x.copy()
        shifted[i] += step
        after = active_at(mean, shifted)
        out.append(ParameterSlopes(
            (problem.residual(after) - residual) / step,
            problem.flat.commands.rise([*before, *random], [*after, *random]) / step,
            (problem.extra_torque_power([*after, *random]) - extra_torque_power) / step,
            loops_differ(problem.data, before, after)))
    return out
