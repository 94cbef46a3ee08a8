"""Fitting hypotheses to flights, and judging them on others.

Mean effects are fitted by Gauss-Newton on the whitened spectra, random ones by their strength; what differs from flight
to flight (offsets) has a prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import minimize_scalar

from airtouch.gap.evidence import random_effects
from airtouch.gap.evidence.cells import CELLS
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.gauss_newton import ITERATIONS, Posterior, gauss_newton, start_of
from airtouch.gap.evidence.least_squares import without_offsets
from airtouch.gap.evidence.problem import BlockSet, Modelled, Problem, problem_of
from airtouch.gap.evidence.slopes import active_at
from airtouch.gap.signals.spectra import squared
from airtouch.gap.signatures.candidates import mean_of, random_of
from airtouch.gap.signatures.signature import MEAN, SPECTRUM
from airtouch.gap.signatures.term import Term, Terms, mean_places
from airtouch.simulation.effects import Active

TURNS = 6  #: turns of fitting mean, then random effects, at most; chosen
SETTLED = 0.3  #: nats that a turn must gain for another to follow; chosen
BRIEF = 2  #: steps of a brief fit; chosen
STRENGTH_ROUNDS = 4  #: rounds in which the strengths of several random effects are fitted in turn; chosen
PRIOR_UNITS = 30.0  #: standard deviation of a parameter's prior, in its natural steps; chosen: it says next to nothing
CELL_GAIN = 1.0  #: nats from which effects count as gaining in a cell; chosen
GRID_SIZE = 40  #: strengths of a random effect that are tried before the best is refined; chosen
LEAST_STRENGTH = 0.003  #: least of them, natural steps; chosen
LARGEST_STRENGTH = 1e3  #: largest of them, natural steps; chosen
LEAST_CURVATURE = 1e-6  #: nats, curvature in the logarithm of a strength, by which is divided at least; chosen
CURVATURE_STEP = 0.15  #: of the logarithm of a strength, over which the likelihood's curvature is taken; chosen


@dataclass(frozen=True)
class FittedTerms:
    """A hypothesis fitted.

    terms: with their values; scaled (k,), covariance (k, k): of the free parameters of its mean effects.
    """

    terms: Terms
    scaled: np.ndarray
    covariance: np.ndarray

    def place(self, term: Term) -> slice:
        """Where the parameters of one of its mean effects are among the k."""
        return next(place for t, place in mean_places(self.terms) if t is term)


def mean_parameters(terms: Sequence[Term]) -> np.ndarray:
    """Scaled parameters (k,) of the mean effects among terms with values."""
    return np.concatenate([np.zeros(0), *(t.scaled(t.values) for t in mean_of(terms))])


def fit(data: Data, part: BlockSet, terms: Sequence[Term], start: np.ndarray | None = None,
        prior: np.ndarray | float = PRIOR_UNITS, brief: bool = False) -> FittedTerms:
    """Fit of effects to the blocks of `part`; the gap that they leave is judged elsewhere.

    start (k,): scaled parameters of mean effects at which it begins, NaN for unknown ones; prior: standard deviation of
    these around neutral. Mean and random effects are fitted in turn, TURNS times at most, until a turn gains less than
    SETTLED; brief: once, mean ones by BRIEF steps.

    The last turn's fit is returned. It may be a little less likely than the one before: the mean fit also weighs the
    priors, which the likelihood leaves out, and begins with the offsets at 0.
    """
    problem = problem_of(data, part)
    mean, random = mean_of(terms), random_of(terms)
    x = start_of(problem, mean, start)
    random_power: np.ndarray | float = 0.0
    # at an unknown start random effects would take up what the mean ones explain: there they follow the first mean fit
    if random and mean and start is not None:
        random = _with_strengths(problem, random, problem.values(active_at(mean, x)), active_at(mean, x))
        random_power = problem.random_power(random)
    last_level = -np.inf
    for _ in range(1 if brief else TURNS):
        posterior = Posterior(problem, mean, random_power, prior, uncertain_floor=bool(random))
        solution = gauss_newton(posterior, x, BRIEF if brief else ITERATIONS)
        x, active = solution.x, active_at(mean, solution.x)
        if not random:
            break
        random = _with_strengths(problem, random, solution.values, active)
        random_power, of_loop = problem.random_power(random), problem.loop_power(active, uncertain_floor=True)
        level = problem.likelihood(solution.values, random_power + of_loop.power) - of_loop.cost
        if not mean or level < last_level + SETTLED:
            break
        last_level = level
    return FittedTerms(_with_values(terms, x, random), x, solution.covariance)


def _with_values(terms: Sequence[Term], x: np.ndarray, random: Sequence[Term]) -> Terms:
    """The terms with their values: mean ones at scaled parameters x (k,), random ones as fitted, in their order."""
    fitted = {MEAN: iter([t.fitted(x[place]) for t, place in mean_places(terms)]), SPECTRUM: iter(random)}
    return tuple(next(fitted[t.shows_in]) if t.shows_in in fitted else t for t in terms)


def judge(data: Data, part: BlockSet, terms: Sequence[Term], uncertain_floor: bool = False) -> float:
    """Log likelihood of blocks under effects fitted elsewhere; offsets between flights fitted anew.

    uncertain_floor: the commands' floor is as uncertain as under random effects, though there are none.
    """
    remainder = left_over(data, part, terms, uncertain_floor)
    return remainder.log_likelihood - remainder.cost


@dataclass(frozen=True, eq=False)
class LeftOver:
    """What effects leave of the gap in some blocks.

    problem: of the blocks; modelled: what the effects make of it; gap (n,): under them, offsets between flights
    subtracted; offset_cost: nats that the offsets cost.
    """

    problem: Problem
    modelled: Modelled
    gap: np.ndarray
    offset_cost: float

    @property
    def extra_power(self) -> np.ndarray:
        """Power (n,) that the effects add to that expected."""
        return self.modelled.extra_power

    @property
    def cost(self) -> float:
        """Nats that the offsets and the commands' floor cost."""
        return self.offset_cost + self.modelled.cost

    @cached_property
    def log_likelihood(self) -> float:
        """Log likelihood of the gap, without the cost."""
        return self.problem.likelihood(self.gap, self.extra_power)

    @property
    def power(self) -> np.ndarray:
        """Expected power (n,) of the gap."""
        return self.problem.elements.power + self.extra_power

    def log_likelihoods(self) -> np.ndarray:
        """Log likelihood (n,) of each value, without the cost."""
        return self.problem.likelihood.per_value(self.gap, self.extra_power)


def left_over(data: Data, part: BlockSet, terms: Sequence[Term], uncertain_floor: bool = False) -> LeftOver:
    """What effects with these parameters leave of the gap; offsets between flights fitted anew.

    uncertain_floor: see `judge`.
    """
    problem = problem_of(data, part)
    modelled = problem.modelled(terms, uncertain_floor)
    return LeftOver(problem, modelled, *without_offsets(problem, modelled.gap, modelled.extra_power))


def cell_gains(data: Data, part: BlockSet, terms: Sequence[Term]) -> np.ndarray:
    """Log likelihood (CELLS,) that effects with these parameters add in each cell: view, channel and band."""
    without = left_over(data, part, (), uncertain_floor=bool(random_of(terms)))
    gains = left_over(data, part, terms).log_likelihoods() - without.log_likelihoods()
    return np.bincount(without.problem.flat.cells, gains, CELLS)


def _with_strengths(problem: Problem, random: Sequence[Term], values: np.ndarray, mean: Sequence[Active],
                    ) -> list[Term]:
    """Random effects with their strengths of highest likelihood, fitted one after another, the others as they are.

    values (n,): the gap under the mean effects `mean`.
    """
    fitted, loop_power = list(random), problem.loop_power(mean, uncertain_floor=True).power
    for _ in range(STRENGTH_ROUNDS if len(fitted) > 1 else 1):
        for i, term in enumerate(fitted):
            others = loop_power + problem.random_power([*fitted[:i], *fitted[i + 1:]])
            fitted[i] = strongest(problem, term, values, others)
    return fitted


def strongest(problem: Problem, term: Term, values: np.ndarray, other_power: np.ndarray) -> Term:
    """A random effect with its strength of highest likelihood; unchanged where it adds no power.

    values (n,): the gap; other_power (n,): that others add.
    """
    _, high = term.bounds()
    unit = problem.random_power([term.fitted(np.ones(len(term.free)))])
    if not unit.any():
        return term

    likelihood = problem.likelihood.along(squared(values), other_power, unit)

    def cost(log_x: float) -> float:
        """Minus the log likelihood at the logarithm of the scaled strength."""
        return -likelihood(random_effects.growth(term, np.exp(log_x)))

    top = np.log(min(float(high[0]), LARGEST_STRENGTH))
    grid = np.linspace(np.log(LEAST_STRENGTH), top, GRID_SIZE)
    best = int(np.argmin([cost(g) for g in grid]))
    around = grid[max(best - 1, 0)], grid[min(best + 1, GRID_SIZE - 1)]
    optimum = minimize_scalar(cost, bounds=around, method="bounded")
    return term.fitted(np.full(len(term.free), float(np.exp(optimum.x))))


def strength_variance(data: Data, part: BlockSet, terms: Sequence[Term], term: Term) -> np.ndarray:
    """Variance (k, k) of a random effect's scaled strength, from the likelihood's curvature.

    It is 1e6 times the strength squared where the likelihood is flat (LEAST_CURVATURE).
    """
    x = term.scaled(term.values)
    levels = []
    for amount in (-CURVATURE_STEP, 0.0, CURVATURE_STEP):
        scaled_term = term.fitted(x * np.exp(amount))
        levels.append(judge(data, part, [scaled_term if t is term else t for t in terms]))
    curvature = (2.0 * levels[1] - levels[0] - levels[2]) / CURVATURE_STEP ** 2
    return np.diag(x ** 2 / max(curvature, LEAST_CURVATURE))
