"""Fitting hypotheses to flights, and judging them on others.

Mean effects are fitted by Gauss-Newton on the whitened spectra, random ones by their
strength; what differs from flight to flight (offsets) has a prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from airtouch.gap.evidence import random_effects
from airtouch.gap.evidence.cells import GROUPS
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.least_squares import bounded_step, cost_of, limits, weights_of, without_offsets
from airtouch.gap.evidence.problem import LOOP, Part, Problem, problem_of
from airtouch.gap.evidence.slopes import Slopes, active_at
from airtouch.gap.signals.spectra import squared
from airtouch.gap.signatures.candidates import MEAN, SPECTRUM, Term, random_of
from airtouch.simulation.effects import Active

ITERATIONS = 8
ENOUGH = 0.02  #: nats that a step must gain for the fit to go on
TRIES = 5  #: attempts at a step, each shorter than the one before (Levenberg-Marquardt)
LEAST_DAMPING, CALMED = 0.01, 0.1  #: damping after a step that failed; factor on it after a step that gained
TURNS, SETTLED = 6, 0.3  #: most turns of fitting mean, then random effects; nats that a further turn must gain
ROUNDS = 4  #: rounds in which the strengths of several random effects are fitted in turn
PRIOR_UNITS = 30.0  #: standard deviation of a parameter's prior, in its natural steps; chosen: it says next to nothing
COMMAND_PRIOR = 1.5  #: the same for effects that only the commands show; chosen
CELL_GAIN = 1.0  #: nats from which effects count as gaining in a cell; chosen
CLOSE = 0.05  #: scaled parameter at which the fit of a new effect begins: some have no slope at neutral itself
GRID = (-2.0, -1.0, -0.5, 0.05, 0.5, 1.0, 1.5, 2.0, 3.0)  #: scaled parameters from which effects of the loop may start


@dataclass
class Fit:
    """A hypothesis fitted: its terms with values, covariance of the scaled parameters, offsets."""

    terms: tuple[Term, ...]
    scaled: np.ndarray
    covariance: np.ndarray
    offsets: np.ndarray
    gained: float  #: log likelihood over the hypothesis of no effect, on the blocks fitted


def fit(data: Data, part: Part, terms: Sequence[Term], start: np.ndarray | None = None,
        prior: np.ndarray | float = PRIOR_UNITS) -> Fit:
    """Fit of effects to the blocks of `part`; the residual is judged elsewhere.

    prior: standard deviation of the scaled parameters of mean effects around neutral.
    """
    problem = problem_of(data, part)
    terms = tuple(terms)
    mean = tuple(t for t in terms if t.kind == MEAN)
    random = random_of(terms)
    x = _start(problem, mean, start)
    offsets, covariance = np.zeros(0), np.zeros((0, 0))
    random_power: np.ndarray | float = 0.0
    if random and mean and start is not None:
        random_power = _random_power(problem, random, problem.values(active_at(mean, x)), active_at(mean, x))
    last_level = -np.inf
    for _ in range(TURNS if random and mean else 1):
        x, offsets, covariance, values = _gauss_newton(problem, mean, x, random_power, prior, bool(random))
        command_power, cost = problem.commanded(active_at(mean, x), bool(random))
        random_power = _random_power(problem, random, values, active_at(mean, x)) if random else 0.0
        level = problem.likelihood(values, random_power + command_power) - cost
        if level < last_level + SETTLED:
            break
        last_level = level
    if random:
        command_power, cost = problem.commanded([*active_at(mean, x), *(t.active() for t in random)], True)
    fitted, first = [], 0
    random_fits = iter(random)
    for t in terms:
        if t.kind == MEAN:
            fitted.append(t.fitted(x[first:first + len(t.free)]))
            first += len(t.free)
        else:
            fitted.append(next(random_fits) if t.kind == SPECTRUM else t)
    gained = problem.likelihood(values, random_power + command_power) - cost
    return Fit(tuple(fitted), x, covariance, offsets, gained)


def judge(data: Data, part: Part, terms: Sequence[Term], wide: bool = False) -> float:
    """Log likelihood of blocks under effects fitted elsewhere; offsets between flights fitted anew.

    wide: the commands' floor is as uncertain as under random effects, though there are none.
    """
    problem, values, added, price = _explained(data, part, terms, wide)
    return problem.likelihood(values, added) - price


def left_over(data: Data, part: Part, terms: Sequence[Term], wide: bool = False,
              ) -> tuple[Problem, np.ndarray, np.ndarray]:
    """The problem, its residual (flattened, offsets subtracted) and the expected power of it. wide: see `judge`."""
    problem, values, added, _ = _explained(data, part, terms, wide)
    return problem, values, problem.power + added


def cell_gains(data: Data, part: Part, terms: Sequence[Term]) -> np.ndarray:
    """Log likelihood (GROUPS,) that effects with these parameters add in each cell: view, channel and band."""
    problem, values, power = left_over(data, part, (), bool(random_of(terms)))
    without = problem.each(values, power - problem.power)
    problem, values, power = left_over(data, part, terms)
    return np.bincount(problem.groups, problem.each(values, power - problem.power) - without, GROUPS)


def _explained(data: Data, part: Part, terms: Sequence[Term], wide: bool = False,
               ) -> tuple[Problem, np.ndarray, np.ndarray, float]:
    """Problem of a part, its residual under effects, the power that they add, and the cost of offsets and floor."""
    problem = problem_of(data, part)
    values, added, cost = problem.modelled(terms, wide)
    residual, penalty = without_offsets(problem, values, added)
    return problem, residual, added, penalty + cost


def _random_power(problem: Problem, random: list[Term], values: np.ndarray, mean: Sequence[Active]) -> np.ndarray:
    """Power that random effects add, their strengths in `random` fitted anew, one after another."""
    commanded, _ = problem.commanded(mean, True)
    for _ in range(ROUNDS if len(random) > 1 else 1):
        for i in range(len(random)):
            random[i] = _strength(problem, random, i, values, commanded)
    return problem.random_power(random)


def _start(problem: Problem, mean: Sequence[Term], known: np.ndarray | None) -> np.ndarray:
    """Scaled parameters (k,) at which a fit begins: the known ones, else (NaN) close to neutral.

    Effects of the loop of which nothing is known begin where their likelihood is highest on a coarse grid.
    """
    size = sum(len(t.free) for t in mean)
    known = np.full(size, np.nan) if known is None else known
    x = np.where(np.isnan(known), CLOSE, known)
    place = 0
    for t in mean:
        own = range(place, place + len(t.free))
        place += len(t.free)
        if t.name not in LOOP or not len(problem.commands) or not np.isnan(known[own]).all():
            continue
        low, high = limits(mean)
        best = -np.inf
        start = x.copy()
        for i in own:
            for amount in GRID:
                trial = start.copy()
                trial[i] = np.clip(amount, low[i], high[i])
                command_power, cost = problem.commanded(active_at(mean, trial))
                level = problem.likelihood(problem.base, command_power) - cost
                if level > best:
                    best, x = level, trial
    return x


def _gauss_newton(problem: Problem, mean: Sequence[Term], x: np.ndarray, added: np.ndarray | float,
                  spread: np.ndarray | float, wide: bool,
                  ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Scaled parameters, offsets, covariance of the parameters, and the residual.

    The slopes are kept from step to step, as most effects are close to linear; a step that gains nothing, or ends far
    from where they were taken, takes them anew.
    """
    constants = problem.constant()
    low, high = limits(mean)
    x = np.clip(x, low, high)
    offsets = np.zeros(len(constants))
    close = np.array([t.name in LOOP for t in mean for _ in t.free], bool)
    spread = np.where(close, np.minimum(spread, COMMAND_PRIOR), spread)
    prior = np.concatenate([spread, [p for _, p in constants]])

    covariance = np.zeros((len(x), len(x)))
    if not mean and not constants:
        return x, offsets, covariance, problem.base

    def at(x: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Residual, power over the floor, and minus the log of the posterior."""
        active = active_at(mean, x)
        values = problem.values(active) if mean else problem.base.copy()
        for amount, (index, column, _) in zip(offsets, problem.offsets, strict=True):
            values[index] -= amount * column
        command_power, price = problem.commanded(active, wide)
        power = added + command_power
        return values, power, price + cost_of(problem, values, power, x, offsets, prior)

    values, power, cost = at(x, offsets)
    slopes, stuck, damping = Slopes(problem, mean, high), False, 0.0
    for _ in range(ITERATIONS):
        slopes.take(x, stuck)
        columns = [*slopes.columns, *(-c for c, _ in constants)]
        weights, of_power = weights_of(problem, values, power), slopes.of_power(x, values, power, wide)
        gain, tries = 0.0, 0
        while gain == 0.0 and tries < TRIES:
            tries += 1
            change, covariance = bounded_step(columns, prior, values, weights, x, offsets, low, high, of_power, damping)
            new_x, new_offsets = np.clip(x + change[:len(x)], low, high), offsets + change[len(x):]
            new_values, new_power, new_cost = at(new_x, new_offsets)
            if new_cost < cost - 1e-9:
                gain, cost = cost - new_cost, new_cost
                x, offsets, values, power = new_x, new_offsets, new_values, new_power
                damping *= CALMED
            else:
                damping = max(damping, LEAST_DAMPING) / CALMED
        if gain < ENOUGH and (gain > 0.0 or stuck or np.array_equal(x, slopes.at)):
            break
        stuck = gain == 0.0
    return x, offsets, covariance, values


def _strength(problem: Problem, random: Sequence[Term], which: int, values: np.ndarray,
              command_power: np.ndarray) -> Term:
    """A random effect's strength of highest likelihood, the others as they are."""
    other_power = command_power + problem.random_power([t for i, t in enumerate(random) if i != which])
    return strongest(problem, random[which], values, other_power)


def strongest(problem: Problem, term: Term, values: np.ndarray, other_power: np.ndarray) -> Term:
    """A random effect with its strength of highest likelihood. values: the residual; other_power: that of others."""
    _, high = term.bounds()
    unit = problem.random_power([term.fitted(np.ones(len(term.free)))])
    if not unit.any():
        return term

    likelihood = problem.likelihoods(squared(values), other_power, unit)

    def cost(log_x: float) -> float:
        """Minus the log likelihood at the logarithm of the scaled strength."""
        return -likelihood(random_effects.growth(term, np.exp(log_x)))

    top = np.log(min(float(high[0]), 1e3))
    grid = np.linspace(np.log(0.003), top, 40)
    costs = [cost(g) for g in grid]
    best = int(np.argmin(costs))
    optimum = minimize_scalar(cost, bounds=(grid[max(best - 1, 0)], grid[min(best + 1, 39)]), method="bounded")
    return term.fitted(np.full(len(term.free), float(np.exp(optimum.x))))


def strength_variance(data: Data, part: Part, terms: Sequence[Term], term: Term) -> np.ndarray:
    """Variance (k, k) of a random effect's scaled strength, from the likelihood's curvature; inf for none."""
    x, step = term.scaled(term.values), 0.15
    levels = []
    for amount in (-step, 0.0, step):
        scaled_term = term.fitted(x * np.exp(amount))
        levels.append(judge(data, part, [scaled_term if t is term else t for t in terms]))
    curvature = (2.0 * levels[1] - levels[0] - levels[2]) / step ** 2
    return np.diag(x ** 2 / max(curvature, 1e-6))
