"""The likeliest strength of random effects, and its variance."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from airtouch.gap.evidence import random_effects
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.problem import BlockSet, Problem
from airtouch.gap.signals.spectra import squared
from airtouch.gap.signatures.term import Term
from airtouch.simulation.effects import Active

#: rounds in which the strengths of several random effects are fitted in turn; chosen for time. A smaller number ends
#: fits of effects that trade against each other too early
STRENGTH_ROUNDS = 4
GRID_SIZE = 40  #: strengths that are tried before the best is refined; chosen. With fewer a lower peak may be refined
LEAST_STRENGTH = 0.003  #: least of them, natural steps; chosen. An effect that is not there is given this strength
#: largest of them, natural steps; chosen, beyond what flights show. A larger number makes the grid coarser
LARGEST_STRENGTH = 1e3
#: least curvature of the likelihood in the logarithm of a strength, nats; chosen: it gives a standard deviation of a
#: thousand times the strength, which says nothing
LEAST_CURVATURE = 1e-6
#: change of the logarithm of a strength over which the curvature is taken; chosen. A larger number sees more of the
#: likelihood's skewness, a smaller one more of the rounding
CURVATURE_STEP = 0.15


def fit_strengths(problem: Problem, random: Sequence[Term], residual: np.ndarray, of_loop: Sequence[Active],
                  ) -> list[Term]:
    """Random effects with their likeliest strengths, fitted one after another, the others as they are.

    residual (n,): under the mean effects; of_loop: these, and random ones as they are, whose noise the loop answers.
    """
    fitted, from_loop = list(random), problem.loop_change(of_loop, uncertain_floor=True).extra_power
    for _ in range(STRENGTH_ROUNDS if len(fitted) > 1 else 1):
        for i, term in enumerate(fitted):
            others = from_loop + problem.random_power([*fitted[:i], *fitted[i + 1:]])
            fitted[i] = fit_strength(problem, term, residual, others)
    return fitted


def fit_strength(problem: Problem, term: Term, residual: np.ndarray, extra_power: np.ndarray) -> Term:
    """A random effect with its likeliest strength; unchanged where it adds no power.

    All its free parameters have one strength: they grow in the proportions of their natural steps, and its force must
    go with that strength. An effect of two independent ones is fitted along that line alone.

    residual (n,); extra_power (n,): that of the other effects.
    """
    _, high = term.bounds()
    of_strength_1 = problem.random_power([term.fitted(np.ones(len(term.free)))])
    if not of_strength_1.any():
        return term

    likelihood = problem.likelihood.along(squared(residual), extra_power, of_strength_1)

    def cost(log_x: float) -> float:
        """Minus the log likelihood at the logarithm of the scaled strength."""
        return -likelihood(random_effects.growth(term, np.exp(log_x)))

    top = np.log(min(float(high[0]), LARGEST_STRENGTH))
    grid = np.linspace(np.log(LEAST_STRENGTH), top, GRID_SIZE)
    best = int(np.argmin([cost(g) for g in grid]))
    around = grid[max(best - 1, 0)], grid[min(best + 1, GRID_SIZE - 1)]
    optimum = minimize_scalar(cost, bounds=around, method="bounded")
    return term.fitted(np.full(len(term.free), float(np.exp(optimum.x))))


def strength_variance(data: Data, blocks: BlockSet, terms: Sequence[Term], term: Term) -> np.ndarray:
    """Variance (k, k) of a random effect's scaled strength, from the likelihood's curvature.

    It is 1e6 times the strength squared where the likelihood is flat (LEAST_CURVATURE). terms: the hypothesis, with its
    values; term: the entry of it whose variance is asked for, not an equal one.
    """
    x = term.scaled(term.values)
    levels = []
    for amount in (-CURVATURE_STEP, 0.0, CURVATURE_STEP):
        scaled_term = term.fitted(x * np.exp(amount))
        levels.append(judge(data, blocks, [scaled_term if t is term else t for t in terms]))
    curvature = (2.0 * levels[1] - levels[0] - levels[2]) / CURVATURE_STEP ** 2
    return np.diag(x ** 2 / max(curvature, LEAST_CURVATURE))
