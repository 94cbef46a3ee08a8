"""Fits of hypotheses to some blocks of flights.

Mean effects are fitted by Gauss-Newton on the whitened spectra (`gauss_newton`), random ones by their strength
(`random_strength`); what differs from flight to flight (offsets) has a prior. `judge` says how likely other blocks are
under the effects fitted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.gauss_newton import MOST_STEPS, Posterior, gauss_newton, start_of
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.problem import BlockSet, problem_of
from airtouch.gap.evidence.random_strength import fit_strengths
from airtouch.gap.evidence.slopes import active_at
from airtouch.gap.signatures.candidates import mean_of, random_of
from airtouch.gap.signatures.signature import MEAN, SPECTRUM
from airtouch.gap.signatures.term import Term, Terms, mean_slices
from airtouch.simulation.effects import Active

#: turns, at most, of fitting mean, then random effects; chosen for time. A smaller number ends more fits before the
#: peak
MOST_TURNS = 6
#: nats that a turn must gain for another to follow; chosen for time. A larger number ends fits farther from the peak
LEAST_TURN_GAIN = 0.3
BRIEF_STEPS = 2  #: steps of a brief fit; chosen for time. A larger number comes closer to the peak
#: restarts, at most, of a fit of several parameters; chosen for time. A larger number can only gain
MOST_RESTARTS = 12
#: standard deviation of a parameter's prior, natural steps; chosen, so that it says next to nothing. A smaller number
#: draws strong effects to neutral
PRIOR_STD = 30.0


@dataclass(frozen=True)
class FittedTerms:
    """A hypothesis fitted.

    terms: with their values; scaled (k,), covariance (k, k): of the free parameters of its mean effects.
    """

    terms: Terms
    scaled: np.ndarray
    covariance: np.ndarray

    def slice_of(self, term: Term) -> slice:
        """The slice of the k parameters that is a mean effect's. term: an entry of `terms` itself, not an equal one."""
        return next(own for t, own in mean_slices(self.terms) if t is term)


def mean_parameters(terms: Sequence[Term]) -> np.ndarray:
    """Scaled parameters (k,) of the mean effects among terms with values."""
    return np.concatenate([np.zeros(0), *(t.scaled(t.values) for t in mean_of(terms))])


def fit(data: Data, blocks: BlockSet, terms: Sequence[Term], start: np.ndarray | None = None,
        prior_std: np.ndarray | float = PRIOR_STD, brief: bool = False) -> FittedTerms:
    """Fit of effects to some blocks.

    start (k,): scaled parameters of mean effects at which it begins, NaN for unknown ones; prior_std: standard
    deviation of these around neutral, natural steps, (k,) or one for all; brief: one turn, BRIEF_STEPS steps of mean
    effects.

    Mean and random effects are fitted in turn, MOST_TURNS times at most, until a turn gains less than LEAST_TURN_GAIN.
    A turn begins where the one before ended, and that of the highest posterior is returned. The fit may end before it
    stands still. Where that matters, `converged` begins it anew and returns the likelier.
    """
    problem = problem_of(data, blocks)
    mean, random = mean_of(terms), random_of(terms)
    x = start_of(problem, mean, start)
    random_power: np.ndarray | float = 0.0
    beside: list[Active] = []  # the random effects as fitted so far
    # at an unknown start random effects would take up what the mean ones explain: there they follow the first mean fit
    if random and mean and start is not None:
        random = fit_strengths(problem, random, problem.residual(active_at(mean, x)), active_at(mean, x))
        random_power, beside = problem.random_power(random), [t.active() for t in random]
    best, highest, offsets = None, -np.inf, None
    for _ in range(1 if brief else MOST_TURNS):
        posterior = Posterior(problem, mean, random_power, prior_std, bool(random), beside)
        solution = gauss_newton(posterior, x, BRIEF_STEPS if brief else MOST_STEPS, offsets)
        x, offsets, active = solution.x, solution.offsets, active_at(mean, solution.x)
        if not random:
            return FittedTerms(_with_values(terms, x, random), x, solution.covariance)
        random = fit_strengths(problem, random, solution.residual, [*active, *beside])
        random_power, beside = problem.random_power(random), [t.active() for t in random]
        reached = Posterior(problem, mean, random_power, prior_std, True, beside)
        level = -reached.at(x, solution.offsets).cost
        settled = not mean or level < highest + LEAST_TURN_GAIN
        if best is None or level > highest:
            best, highest = FittedTerms(_with_values(terms, x, random), x, solution.covariance), level
        if settled:
            break
    assert best is not None  # there is one turn at least
    return best


def converged(data: Data, blocks: BlockSet, best: FittedTerms) -> FittedTerms:
    """The likeliest of fits that begin where the one before ended, until one gains less than LEAST_TURN_GAIN.

    best: the first of them, which is returned as it is where its mean effects have one parameter or none.

    Parameters that trade against each other, as a battery's charge and capacity, lie along a bent valley, which one fit
    leaves off half way: strengths of seven simulated batteries came out up to a third too small.
    """
    level = judge(data, blocks, best.terms)
    for _ in range(MOST_RESTARTS if len(best.scaled) > 1 else 0):
        again = fit(data, blocks, best.terms, best.scaled)
        reached = judge(data, blocks, again.terms)
        if reached > level:
            best = again
        if reached < level + LEAST_TURN_GAIN:
            break
        level = reached
    return best


def _with_values(terms: Sequence[Term], x: np.ndarray, random: Sequence[Term]) -> Terms:
    """The terms with their values: mean ones at scaled parameters x (k,), random ones as fitted, in their order."""
    fitted = {MEAN: iter([t.fitted(x[own]) for t, own in mean_slices(terms)]), SPECTRUM: iter(random)}
    return tuple(next(fitted[t.shows_in]) if t.shows_in in fitted else t for t in terms)
