"""Fitting hypotheses to flights, and judging them on others.

Mean effects are fitted by Gauss-Newton on the whitened spectra, random ones by their
strength; what differs from flight to flight (offsets) has a prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from airtouch.gap import random_effects
from airtouch.gap.candidates import MEAN, SPECTRUM, Term
from airtouch.gap.data import Data
from airtouch.gap.least_squares import bounded_step, cost_of, limits, weights_of, without_offsets
from airtouch.gap.problem import LOOP, Part, Problem, problem_of
from airtouch.simulation.effects import Active

ITERATIONS = 8
ROUNDS = 4  #: in which the strengths of several random effects are fitted in turn
PRIOR_UNITS = 30.0  #: standard deviation of a parameter's prior, in its natural steps
COMMAND_PRIOR = 1.5  #: the same, where only the commands tell
GRID = (-2.0, -1.0, -0.5, 0.05, 0.5, 1.0, 1.5, 2.0, 3.0)  #: coarse, of scaled parameters


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
    """Fit effects to the blocks of `part`; what is left is judged elsewhere.

    prior: standard deviation of the scaled parameters of mean effects around neutral.
    """
    problem = problem_of(data, part)
    terms = tuple(terms)
    mean = tuple(t for t in terms if t.kind == MEAN)
    random = [t for t in terms if t.kind == SPECTRUM]
    x = _start(problem, mean) if start is None else start
    added = problem.random_power(random) if random else 0.0
    offsets, covariance = np.zeros(0), np.zeros((0, 0))
    for _ in range(2 if mean and random else 1):
        x, offsets, covariance, values = _gauss_newton(problem, mean, x, added, prior, bool(random))
        told, cost = problem.commanded(_active(mean, x), bool(random))
        for _ in range(ROUNDS if len(random) > 1 else 1):
            for i in range(len(random)):
                random[i] = _strength(problem, random, i, values, told)
        added = problem.random_power(random) if random else 0.0
    if random:
        told, cost = problem.commanded([*_active(mean, x), *(t.active() for t in random)], True)
    fitted, place = [], 0
    chosen = iter(random)
    for t in terms:
        if t.kind == MEAN:
            fitted.append(t.fitted(x[place:place + len(t.free)]))
            place += len(t.free)
        else:
            fitted.append(next(chosen) if t.kind == SPECTRUM else t)
    gained = problem.likelihood(values, added + told) - cost
    return Fit(tuple(fitted), x, covariance, offsets, gained)


def judge(data: Data, part: Part, terms: Sequence[Term], wide: bool = False) -> float:
    """Log likelihood of blocks under effects fitted elsewhere; offsets between flights found anew.

    wide: the commands' floor is as uncertain as under random effects, though there are none.
    """
    problem, values, added, price = _explained(data, part, terms, wide)
    return problem.likelihood(values, added) - price


def left_over(data: Data, part: Part, terms: Sequence[Term]) -> tuple[Problem, np.ndarray, np.ndarray]:
    """The problem, what is left (flattened, offsets taken off) and the power that it should have."""
    problem, values, added, _ = _explained(data, part, terms)
    return problem, values, problem.power + added


def _explained(data: Data, part: Part, terms: Sequence[Term], wide: bool = False,
               ) -> tuple[Problem, np.ndarray, np.ndarray, float]:
    """What effects leave of a part, the power that they add, and what offsets and the commands' floor cost."""
    problem = problem_of(data, part)
    values, added, cost = problem.modelled(terms, wide)
    left, penalty = without_offsets(problem, values, added)
    return problem, left, added, penalty + cost


def _start(problem: Problem, mean: Sequence[Term]) -> np.ndarray:
    """Close to neutral; effects of the commands alone where their likelihood is highest on a coarse grid."""
    x = np.concatenate([np.full(len(t.free), 0.05) for t in mean]) if mean else np.zeros(0)
    place = 0
    for t in mean:
        here = range(place, place + len(t.free))
        place += len(t.free)
        if t.name not in LOOP or not len(problem.twin):
            continue
        low, high = limits(mean)
        best = -np.inf
        start = x.copy()
        for i in here:
            for amount in GRID:
                moved = start.copy()
                moved[i] = np.clip(amount, low[i], high[i])
                told, cost = problem.commanded(_active(mean, moved))
                found = problem.likelihood(problem.base, told) - cost
                if found > best:
                    best, x = found, moved
    return x


def _active(mean: Sequence[Term], x: np.ndarray) -> list[Active]:
    out, place = [], 0
    for t in mean:
        out.append(t.active(x[place:place + len(t.free)]))
        place += len(t.free)
    return out


def _gauss_newton(problem: Problem, mean: Sequence[Term], x: np.ndarray, added: np.ndarray | float,
                  spread: np.ndarray | float, wide: bool,
                  ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Scaled parameters, offsets, covariance of the parameters, and what is left."""
    constants = problem.constant()
    low, high = limits(mean)
    x = np.clip(x, low, high)
    offsets = np.zeros(len(constants))
    close = np.array([t.name in LOOP for t in mean for _ in t.free], bool)
    spread = np.where(close, np.minimum(spread, COMMAND_PRIOR), spread)
    prior = np.concatenate([spread, [p for _, p in constants]])
    push = lambda o: sum((a * c for a, (c, _) in zip(o, constants, strict=True)), np.zeros(len(problem.base)))
    raw = problem.values(_active(mean, x)) if mean else problem.base
    values = raw - push(offsets)
    covariance = np.zeros((len(x), len(x)))
    if not mean and not constants:
        return x, offsets, covariance, values
    told, price = problem.commanded(_active(mean, x), wide)
    cost = price + cost_of(problem, values, added + told, x, offsets, prior)
    for _ in range(ITERATIONS):
        columns, others = [], []
        for i in range(len(x)):
            step = 0.02 if x[i] + 0.02 <= high[i] else -0.02
            moved = x.copy()
            moved[i] += step
            others.append((_active(mean, moved), step))
            columns.append((problem.values(others[-1][0]) - raw) / step)
        columns += [-c for c, _ in constants]
        change, covariance = bounded_step(
            columns, prior, values, weights_of(problem, values, added + told), x, offsets, low, high,
            problem.twin.slopes(_active(mean, x), others, wide))
        scale, better = 1.0, False
        while scale > 0.05:
            new_x = np.clip(x + scale * change[:len(x)], low, high)
            new_o = offsets + scale * change[len(x):]
            new_raw = problem.values(_active(mean, new_x)) if mean else problem.base
            new_values = new_raw - push(new_o)
            new_told, price = problem.commanded(_active(mean, new_x), wide)
            new_cost = price + cost_of(problem, new_values, added + new_told, new_x, new_o, prior)
            if new_cost < cost - 1e-9:
                better = True
                break
            scale *= 0.4
        if not better:
            break
        gain, cost = cost - new_cost, new_cost
        x, offsets, raw, values, told = new_x, new_o, new_raw, new_values, new_told
        if gain < 0.01:
            break
    return x, offsets, covariance, values


def _strength(problem: Problem, random: Sequence[Term], which: int, values: np.ndarray,
              told: np.ndarray) -> Term:
    """A random effect's strength of highest likelihood, the others as they are."""
    term = random[which]
    others = told + problem.random_power([t for i, t in enumerate(random) if i != which])
    low, high = term.bounds()
    unit = problem.random_power([term.fitted(np.ones(len(term.free)))])
    if not unit.any():
        return term

    def cost(log_x: float) -> float:
        return -problem.likelihood(values, others + random_effects.growth(term, np.exp(log_x)) * unit)

    top = np.log(min(float(high[0]), 1e3))
    grid = np.linspace(np.log(0.003), top, 40)
    costs = [cost(g) for g in grid]
    best = int(np.argmin(costs))
    found = minimize_scalar(cost, bounds=(grid[max(best - 1, 0)], grid[min(best + 1, 39)]), method="bounded")
    return term.fitted(np.full(len(term.free), float(np.exp(found.x))))


def strength_variance(data: Data, part: Part, terms: Sequence[Term], term: Term) -> np.ndarray:
    """Variance (k, k) of a random effect's scaled strength, from the likelihood's curvature; inf for none."""
    x, step = term.scaled(term.values), 0.15
    at = []
    for amount in (-step, 0.0, step):
        moved = term.fitted(x * np.exp(amount))
        at.append(judge(data, part, [moved if t is term else t for t in terms]))
    bend = (2.0 * at[1] - at[0] - at[2]) / step ** 2
    return np.diag(x ** 2 / max(bend, 1e-6))
