"""One variant screened: by its first-order change of the residual, or by the strength of its random effect.

It costs one replay for each free parameter, whose result both halves of the data share. Candidates that do well here
are then fitted in full.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.evidence.data import Data, residual_spectra
from airtouch.gap.evidence.fit import PRIOR_STD
from airtouch.gap.evidence.judge import JudgedBlocks
from airtouch.gap.evidence.least_squares import (
    Bounds,
    bounded_step,
    bounds_of,
    normal_equations,
    weights_of,
    without_offsets,
)
from airtouch.gap.evidence.problem import TWO_FOLDS, Problem
from airtouch.gap.evidence.random_strength import fit_strength
from airtouch.gap.signatures.signature import MEAN
from airtouch.gap.signatures.term import Term

#: change of a scaled parameter, in natural steps, over which the slope of the spectra is taken; chosen. A larger number
#: takes the slope over more of the curve, a smaller one is nearer to rounding
STEP = 0.25
#: least-squares fits, each with the weights of the residual of the one before; chosen. A larger number takes more time
REWEIGHTINGS = 3
#: change of a spectrum per natural step, unit/sqrt(Hz), up to which it counts as none; chosen, far above rounding. With
#: a larger number more effects count as shown by the commands alone
LEAST_CHANGE = 1e-9
UNBOUNDED = 1e6  #: bound of the scaled parameters of the base, larger than any that is fitted; chosen


@dataclass(frozen=True)
class FirstOrder:
    """Mean effects judged to first order.

    gain: held-out nats; estimates, variances: for each half the k scaled parameters as fitted to it, and their
    variances.
    """

    gain: float
    estimates: Sequence[np.ndarray]
    variances: Sequence[np.ndarray]


def judge_means(data: Data, halves: Sequence[JudgedBlocks], terms: Sequence[Term], base: Sequence[Term] = (),
                ) -> FirstOrder:
    """Mean effects to first order, fitted to the residual of one half, judged on that of the other.

    halves: each under a base that was fitted to the other; base: the effects of that, free to change.
    """
    mean, mean_of_base = _in_the_replay(terms), _in_the_replay(base)
    tables = [[column(data, half.problem, t, i) for t in (*mean, *mean_of_base) for i in range(len(t.free))]
              for half in halves]
    k = sum(len(t.free) for t in mean)
    bounds = _bounds(mean, len(tables[0]) - k)
    gain, estimates, variances = 0.0, [], []
    for train, test in TWO_FOLDS:
        x, variance = _least_squares(halves[train], tables[train], bounds)
        held_out = halves[test]
        moved = sum((a * c for a, c in zip(x, tables[test], strict=True)), np.zeros(len(held_out.residual)))
        after, cost = without_offsets(held_out.problem, held_out.modelled.residual + moved, held_out.extra_power)
        gain += held_out.problem.likelihood(after, held_out.extra_power) - cost - held_out.log_likelihood \
            + held_out.offset_cost
        estimates.append(x[:k])
        variances.append(variance[:k])
    return FirstOrder(gain, estimates, variances)


def _in_the_replay(terms: Sequence[Term]) -> list[Term]:
    """The mean effects that show where the logged commands are replayed."""
    return [t for t in terms if t.shows_in == MEAN and not t.signature.commands_only]


def judge_random(halves: Sequence[JudgedBlocks], term: Term) -> tuple[float, np.ndarray]:
    """Held-out nats of a random effect beside a base, and its scaled strength (k,), the mean of both halves.

    halves: each under a base that was fitted to the other; it stays as it is.
    """
    gain, strengths = 0.0, []
    for train, test in TWO_FOLDS:
        fitted = fit_strength(halves[train].problem, term, halves[train].residual, halves[train].extra_power)
        held_out = halves[test]
        power = held_out.extra_power + held_out.problem.random_power([fitted])
        gain += held_out.problem.likelihood(held_out.residual, power) - held_out.log_likelihood
        strengths.append(fitted.scaled(fitted.values))
    return gain, np.mean(strengths, axis=0)


def shows(data: Data, term: Term) -> bool:
    """Whether a term changes the residual where the logged commands are replayed.

    An effect of the closed loop, such as another gain, leaves no trace there: the commands alone show it.
    """
    return any(np.abs(v).max(initial=0.0) > LEAST_CHANGE for i in range(len(term.free))
               for flight in _change(data, term, i) for v in flight.values())


def column(data: Data, problem: Problem, term: Term, i: int) -> np.ndarray:
    """Change (n,) of the residual of a problem per scaled parameter i of a term at neutral."""
    gathered = problem.flat.layout.gather(_change(data, term, i))
    return np.where(problem.elements.valid, problem.flat.joined(gathered), 0.0)


def _change(data: Data, term: Term, i: int) -> list[dict[str, np.ndarray]]:
    """Change of the residual spectra per scaled parameter i of a term at neutral, by flight and state; made once."""
    def make() -> list[dict[str, np.ndarray]]:
        """The change over STEP, by flight and state."""
        low, high = term.bounds()
        x = np.zeros(len(term.free))
        x[i] = STEP if STEP <= high[i] else -STEP
        neutral = [term.active(np.zeros(len(term.free)))]
        before = residual_spectra(data, neutral) if term.acts_when_neutral else data.residual
        after = residual_spectra(data, [term.active(x)])
        return [{state: ((a[state] - b[state]) / x[i]).astype(np.complex64) for state in a}
                for a, b in zip(after, before, strict=True)]

    variant = tuple(sorted((k, v) for k, v in term.values.items() if k not in term.free))
    return data.workspace.cached("change", (term.name, term.free[i], variant, term.gate), make)


def _bounds(mean: Sequence[Term], others: int) -> Bounds:
    """Lowest and highest scaled parameters of mean effects, followed by `others` without bounds, (k + others,) each."""
    low, high = bounds_of(mean)
    wide = np.full(others, UNBOUNDED)
    return Bounds(np.concatenate([low, -wide]), np.concatenate([high, wide]))


def _least_squares(half: JudgedBlocks, table: Sequence[np.ndarray], bounds: Bounds,
                   ) -> tuple[np.ndarray, np.ndarray]:
    """The likeliest scaled parameters (k,) of a half, and their variances (k,).

    table: change (n,) of the residual per scaled parameter, k of them.
    """
    k, columns, offsets = len(table), np.array(table), half.problem.offsets
    prior_stds = np.concatenate([np.full(k, PRIOR_STD), [o.prior_std for o in offsets]])
    x, amounts, residual = np.zeros(k), np.zeros(len(offsets)), half.modelled.residual
    for _ in range(REWEIGHTINGS):
        weights = weights_of(half.problem, residual, half.extra_power)
        equations = normal_equations(columns, prior_stds, residual, weights, np.concatenate([x, amounts]), offsets)
        change, covariance = bounded_step(equations, x, bounds)
        x = np.clip(x + change[:k], *bounds)
        amounts = amounts + change[k:]
        residual = half.modelled.residual + x @ columns
        for amount, (indices, column, _) in zip(amounts, offsets, strict=True):
            residual[indices] -= amount * column
    return x, np.diag(covariance)
