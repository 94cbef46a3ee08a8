"""Fitting hypotheses to flights, and judging them on others.

Mean effects are fitted by Gauss-Newton on the whitened spectra, random ones by their
strength; what differs from flight to flight (offsets) has a prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from airtouch.gap.evidence import random_effects
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.least_squares import bounded_step, cost_of, limits, weights_of, without_offsets
from airtouch.gap.evidence.problem import GROUPS, LOOP, Part, Problem, problem_of
from airtouch.gap.signals.spectra import squared
from airtouch.gap.signatures.candidates import MEAN, SPECTRUM, Term, random_of
from airtouch.simulation.effects import Active

ITERATIONS = 8
ENOUGH = 0.02  #: gain of a step, nats, below which a fit ends
STEP = 0.02  #: of a scaled parameter, over which slopes are taken
TRIES = 5  #: of a step, each shorter than the one before (Levenberg-Marquardt)
LEAST_DAMPING, CALMED = 0.01, 0.1  #: of a step after one that failed; by what a step that gains multiplies it
FAR = 0.3  #: change of a scaled parameter, of its size or of 1, over which slopes are taken anew
TURNS, SETTLED = 6, 0.3  #: in which mean and random effects are fitted, at most, and the gain below which no more are
ROUNDS = 4  #: in which the strengths of several random effects are fitted in turn
PRIOR_UNITS = 30.0  #: standard deviation of a parameter's prior, in its natural steps
COMMAND_PRIOR = 1.5  #: the same, where only the commands tell
CELL_GAIN = 1.0  #: log likelihood that effects gain in a cell which they move
CLOSE = 0.05  #: to neutral, scaled, where a fit of a new effect begins: some have no slope at neutral itself
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
    random = random_of(terms)
    x = _start(problem, mean, start)
    offsets, covariance = np.zeros(0), np.zeros((0, 0))
    added: np.ndarray | float = 0.0
    if random and mean and start is not None:
        added = _random_power(problem, random, problem.values(_active(mean, x)), _active(mean, x))
    before = -np.inf
    for _ in range(TURNS if random and mean else 1):
        x, offsets, covariance, values = _gauss_newton(problem, mean, x, added, prior, bool(random))
        told, cost = problem.commanded(_active(mean, x), bool(random))
        added = _random_power(problem, random, values, _active(mean, x)) if random else 0.0
        reached = problem.likelihood(values, added + told) - cost
        if reached < before + SETTLED:
            break
        before = reached
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


def left_over(data: Data, part: Part, terms: Sequence[Term], wide: bool = False,
              ) -> tuple[Problem, np.ndarray, np.ndarray]:
    """The problem, what is left (flattened, offsets taken off) and the power that it should have. wide: see `judge`."""
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
    """What effects leave of a part, the power that they add, and what offsets and the commands' floor cost."""
    problem = problem_of(data, part)
    values, added, cost = problem.modelled(terms, wide)
    left, penalty = without_offsets(problem, values, added)
    return problem, left, added, penalty + cost


def _random_power(problem: Problem, random: list[Term], values: np.ndarray, mean: Sequence[Active]) -> np.ndarray:
    """Power that random effects add, their strengths in `random` fitted anew, one after another."""
    commanded, _ = problem.commanded(mean, True)
    for _ in range(ROUNDS if len(random) > 1 else 1):
        for i in range(len(random)):
            random[i] = _strength(problem, random, i, values, commanded)
    return problem.random_power(random)


def _start(problem: Problem, mean: Sequence[Term], known: np.ndarray | None) -> np.ndarray:
    """What is known, else (NaN) close to neutral; effects of the loop, of which nothing is known, where their

    likelihood is highest on a coarse grid.
    """
    size = sum(len(t.free) for t in mean)
    known = np.full(size, np.nan) if known is None else known
    x = np.where(np.isnan(known), CLOSE, known)
    place = 0
    for t in mean:
        here = range(place, place + len(t.free))
        place += len(t.free)
        if t.name not in LOOP or not len(problem.commands) or not np.isnan(known[here]).all():
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
    """Mean effects at scaled parameters x (k,), without those that are neutral there."""
    out, place = [], 0
    for t in mean:
        own = x[place:place + len(t.free)]
        place += len(t.free)
        if own.any() or t.acts_when_neutral:
            out.append(t.active(own))
    return out


class Slopes:
    """First-order changes of the spectra by the mean effects' parameters, taken anew only where a fit has moved far."""

    def __init__(self, problem: Problem, mean: Sequence[Term], high: np.ndarray) -> None:
        self.problem, self.mean, self.high = problem, mean, high
        size = sum(len(t.free) for t in mean)
        self.at = np.full(size, np.inf)  #: scaled parameters (k,) at which they were taken
        self.columns = [np.zeros(0)] * size
        self.rises, self.powers = [np.zeros(0)] * size, [np.zeros(0)] * size
        self.bent = np.ones(size, bool)  #: parameters that change the loop, in which nothing is linear

    def take(self, x: np.ndarray, anew: bool = False) -> None:
        """Take them at scaled parameters x (k,): those that bend; all where x is far from the last, or when told."""
        anew = anew or bool((np.abs(x - self.at) > FAR * np.maximum(np.abs(x), 1.0)).any())
        moved = np.arange(len(x)) if anew else np.flatnonzero(self.bent)
        if not len(moved):
            return
        before = _active(self.mean, x)
        values, power = self.problem.values(before), self.problem.of_torque(before)
        for i in moved:
            step = STEP if x[i] + STEP <= self.high[i] else -STEP
            there = x.copy()
            there[i] += step
            after = _active(self.mean, there)
            self.columns[i] = (self.problem.values(after) - values) / step
            self.rises[i] = self.problem.commands.rise(before, after) / step
            self.powers[i] = (self.problem.of_torque(after) - power) / step
            self.bent[i] = self.problem.bends(before, after)
        self.at = x.copy() if anew else self.at

    def of_power(self, x: np.ndarray, values: np.ndarray, added: np.ndarray | float, wide: bool,
                 ) -> tuple[np.ndarray, np.ndarray]:
        """Gradient (k,) and information (k, k) of the likelihood by what parameters x (k,) do to the expected power.

        values, added: what is left, and the power over the floor, flattened.
        """
        problem = self.problem
        gradient, information = problem.commands.slopes(_active(self.mean, x), np.array(self.rises), wide)
        powers = np.array(self.powers)
        if powers.any():
            push, weight = problem.power_slopes(values, np.broadcast_to(added, values.shape))
            gradient = gradient + powers @ push
            information = information + (powers * weight) @ powers.T
        return gradient, information


def _gauss_newton(problem: Problem, mean: Sequence[Term], x: np.ndarray, added: np.ndarray | float,
                  spread: np.ndarray | float, wide: bool,
                  ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Scaled parameters, offsets, covariance of the parameters, and what is left.

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
        """What is left, the power over the floor, and minus the log of the posterior."""
        active = _active(mean, x)
        values = problem.values(active) if mean else problem.base.copy()
        for amount, (here, column, _) in zip(offsets, problem.offsets, strict=True):
            values[here] -= amount * column
        commanded, price = problem.commanded(active, wide)
        power = added + commanded
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
              told: np.ndarray) -> Term:
    """A random effect's strength of highest likelihood, the others as they are."""
    others = told + problem.random_power([t for i, t in enumerate(random) if i != which])
    return strongest(problem, random[which], values, others)


def strongest(problem: Problem, term: Term, values: np.ndarray, others: np.ndarray) -> Term:
    """A random effect with its strength of highest likelihood. values: what is left; others: power added by others."""
    _, high = term.bounds()
    unit = problem.random_power([term.fitted(np.ones(len(term.free)))])
    if not unit.any():
        return term

    likelihood = problem.likelihoods(squared(values), others, unit)

    def cost(log_x: float) -> float:
        return -likelihood(random_effects.growth(term, np.exp(log_x)))

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
