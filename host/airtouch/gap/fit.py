"""Fitting hypotheses to flights: Whittle likelihood of the gap's spectra against the floor.

A bin's power e over what the floor and the random effects give is exponential when the
hypothesis holds; since the floor itself is estimated from few flights, a Student-like
tail stands in for it. Mean effects are fitted by Gauss-Newton on the whitened spectra,
random ones by their strength; what differs from flight to flight (offsets) has a prior.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar
from scipy.special import exp1

from airtouch.gap import random_effects
from airtouch.gap.candidates import MEAN, SPECTRUM, Term
from airtouch.gap.channels import COMMAND, COUNT, TORQUE, angular_acceleration, residual
from airtouch.gap.flight import Flight
from airtouch.gap.motion import held
from airtouch.gap.response import FIRST_BIN, Response
from airtouch.gap.spectra import AIR, OVERLAP_WEIGHT, REST, Floor, blocks, frequencies, judged, starts
from airtouch.gap.twin import COMMAND_ONLY, Twin
from airtouch.gap.twin_view import TwinView
from airtouch.simulation.effects import Active
from airtouch.vehicle import Vehicle

OFFSETS = 6  #: channels (force, torque) whose mean may differ from flight to flight
ITERATIONS = 8
ROUNDS = 4  #: in which the strengths of several random effects are fitted in turn
PRIOR_UNITS = 30.0  #: standard deviation of a parameter's prior, in its natural steps
LOOP = frozenset({"sensor_latency", "controller_gain"})  #: effects that only the loop's spectra show
GRID = (-2.0, -1.0, -0.5, 0.05, 0.5, 1.0, 1.5, 2.0, 3.0)  #: coarse, of scaled parameters
COMMAND_PRIOR = 1.5  #: the same, where only the commands tell
DOUBT = 0.25  #: of a change of the torque by effects that change the loop: the loop model is no better
FREEDOM = 12.0  #: of the Student-like tail at most
KEPT, KEPT_SAMPLES = 64, 20000  #: hypotheses whose spectra are kept, of flights no longer than this together


@dataclass(frozen=True)
class Study:
    """What a diagnosis holds flights against: vehicle, calibration, controller and floor."""

    vehicle: Vehicle
    calibration: tuple[Active, ...]
    controller: Twin | None
    floor: Floor
    response: Response | None = None
    usual: Any = None  #: generic.Usual of the nominal flights


@dataclass
class Data:
    """Flights with their blocks and the spectra of the gap before any effect is added.

    slow: torque counts below the bins in which commands hold aliases only.
    """

    study: Study
    flights: Sequence[Flight]
    slow: bool = False
    first: list[dict[str, np.ndarray]] = field(default_factory=list)
    base: list[dict[str, np.ndarray]] = field(default_factory=list)
    turning: list[np.ndarray] = field(default_factory=list)  #: spectra in the air of the measured angular acceleration

    quiet: list[np.ndarray] = field(default_factory=list)  #: blocks in the air and axes where no set-point stepped

    def __post_init__(self) -> None:
        self.first = [{r: starts(f, r) for r in (AIR, REST)} for f in self.flights]
        self.turning = [blocks(angular_acceleration(f), b[AIR], AIR) for f, b in zip(self.flights, self.first, strict=True)]
        if self.study.response is not None:
            self.quiet = [self.study.response.quiet(t - b[AIR][:, :, TORQUE])
                          for t, b in zip(self.turning, _replayed(self, ()), strict=True)]
        self.base = spectra(self, ())


def spectra(data: Data, active: Sequence[Active]) -> list[dict[str, np.ndarray]]:
    """Spectra of the gap with effects in the model, by flight and regime; commands are the twin view's.

    Where nominal flights tell how the gyro follows the commands, torque is compared with what that leaves to expect.
    """
    response = data.study.response
    replayed = [a for a in active if a.effect.name not in COMMAND_ONLY]
    every = _replayed(data, replayed)
    if response is None:
        return every
    law = data.study.controller
    beside = [a for a in replayed if not law.changes_loop((a,))]
    through = [a for a in beside if a.effect.wrench is None]
    change = law.torque_change(active, frequencies(AIR))
    sets = zip(data.flights, data.quiet, data.turning, *(_replayed(data, s) for s in ((), through, beside)), every, strict=True)
    return [e if f.rates is None else {**e, AIR: response.applied(q, m, n[AIR], d[AIR], o[AIR], e[AIR], change)}
            for f, q, m, n, d, o, e in sets]


def _replayed(data: Data, active: Sequence[Active]) -> list[dict[str, np.ndarray]]:
    """Spectra of what was measured minus what the model makes of the logged commands."""
    study, out = data.study, []
    kept = data.__dict__.setdefault("_spectra", {})
    key = tuple((a.effect.name, *a.values.values()) for a in active)
    if key in kept:
        return kept[key]
    for flight, first in zip(data.flights, data.first, strict=True):
        left = residual(flight, study.vehicle, (*study.calibration, *active))
        left = held(np.where(flight.lost[:, None], np.nan, left))
        out.append({r: blocks(left, first[r], r) for r in first})
    if not active or sum(len(f) for f in data.flights) <= KEPT_SAMPLES:
        if len(kept) >= KEPT:
            kept.pop(next(k for k in kept if k))
        kept[key] = out
    return out


@dataclass(frozen=True)
class Part:
    """Which blocks of which flights: (flight, regime, chosen bool array), for fitting or judging."""

    pieces: tuple[tuple[int, str, np.ndarray], ...]


@dataclass
class Fit:
    """A hypothesis fitted: its terms with values, covariance of the scaled parameters, offsets."""

    terms: tuple[Term, ...]
    scaled: np.ndarray
    covariance: np.ndarray
    offsets: np.ndarray
    gained: float  #: log likelihood over the hypothesis of no effect, on the blocks fitted


class Problem:
    """Blocks flattened to one array: rows are (block, bin, channel) values that count."""

    def __init__(self, data: Data, part: Part) -> None:
        self.data, self.part = data, part
        self._constant: list[tuple[np.ndarray, float]] | None = None
        self.keep = {r: judged(r) for r in (AIR, REST)}
        for keep in self.keep.values():
            keep[:, COMMAND] = False  # the twin view judges them
        if data.slow:
            self.keep[AIR][FIRST_BIN:, TORQUE] = False
        self.twin = TwinView(data.study.controller, data.flights, data.first, part.pieces)
        self.power = self._gather([{r: np.broadcast_to(data.study.floor.power[r], s[r].shape) for r in s}
                                   for s in data.base]).real
        self.channel = self._gather([{r: np.broadcast_to(np.arange(COUNT), s[r].shape) for r in s}
                                     for s in data.base]).real.astype(int)
        self.flight = np.concatenate([np.full(self._size(p), p[0]) for p in part.pieces]) \
            if part.pieces else np.zeros(0, int)
        self.base = self._gather(data.base)
        self.known = np.isfinite(self.base)
        self.power = np.where(self.known, self.power, 1.0)
        self.base = np.where(self.known, self.base, 0.0)
        counts = data.study.floor.blocks
        nu = [np.full(self._size(p), np.clip(3.0 * counts[p[1]], 2.0, FREEDOM)) for p in part.pieces]
        self.freedom = np.concatenate(nu) if nu else np.zeros(0)
        self.own = len(self.base)  #: elements of the replay view; those of the twin view follow
        self.torque = (self.channel >= TORQUE.start) & (self.channel < TORQUE.stop)
        twin = self.twin
        self.power = np.concatenate([self.power, twin.floor])
        self.base = np.concatenate([self.base, twin.values])
        self.known = np.concatenate([self.known, np.ones(len(twin), bool)])
        self.channel = np.concatenate([self.channel, twin.channel]).astype(int)
        self.flight = np.concatenate([self.flight, twin.flight]).astype(int)
        self.tail = np.concatenate([tail(self.freedom), twin.freedom])  #: the twin's floor has its tails in it
        self.freedom = np.concatenate([self.freedom, twin.freedom])

    def _size(self, piece: tuple[int, str, np.ndarray]) -> int:
        return int(piece[2].sum()) * int(self.keep[piece[1]].sum())

    def _gather(self, by_flight: Sequence[dict[str, np.ndarray]]) -> np.ndarray:
        parts = [by_flight[i][r][chosen][:, self.keep[r]].ravel() for i, r, chosen in self.part.pieces]
        return np.concatenate(parts).astype(complex) if parts else np.zeros(0, complex)

    def values(self, active: Sequence[Active]) -> np.ndarray:
        """Spectra with effects in the model, flattened."""
        seen = [a for a in active if a.effect.name not in COMMAND_ONLY or a.effect.name in LOOP]
        own = self._gather(spectra(self.data, seen)) if seen else self.base[:self.own]
        return np.where(self.known, self._with_twin(own, self.twin.moved(active)), 0.0)

    def _with_twin(self, own: np.ndarray, twin: np.ndarray | float = 0.0) -> np.ndarray:
        return np.concatenate([own, np.broadcast_to(twin, len(self.twin))])

    def commanded(self, active: Sequence[Active], wide: bool = False) -> tuple[np.ndarray, float]:
        """Power that a hypothesis adds to the commands' floor, flattened, and its cost. `wide`: TwinView."""
        power, cost = self.twin.power(active, wide)
        return np.concatenate([self._doubt(active), power - self.twin.floor]), cost

    def _doubt(self, active: Sequence[Active]) -> np.ndarray:
        """Power (own,) of what the loop model may be wrong by in the torque that it changes."""
        law = self.data.study.controller
        loop = [a for a in active if a.effect.name not in COMMAND_ONLY or a.effect.name in LOOP] if law else []
        if not self.own or not loop or not law.changes_loop(loop):
            return np.zeros(self.own)
        change = np.where(self.known[:self.own], self._gather(spectra(self.data, loop)) - self.base[:self.own], 0.0)
        return DOUBT ** 2 * np.abs(change) ** 2 * self.torque

    def constant(self) -> list[tuple[np.ndarray, float]]:
        """Spectra of a unit offset in each of the OFFSETS channels of each flight, with its prior's deviation."""
        if self._constant is None:
            self._constant = self._constants()
        return self._constant

    def _constants(self) -> list[tuple[np.ndarray, float]]:
        columns = []
        tell = self.data.study.floor.offset
        for i, flight in enumerate(self.data.flights):
            for c in range(OFFSETS):
                if tell[c] <= 0.0:
                    continue
                ones = np.zeros((len(flight), COUNT))
                ones[~flight.on_ground, c] = 1.0
                made = [{r: blocks(ones, f[r], r) if j == i else np.zeros_like(self.data.base[j][r])
                         for r in f} for j, f in enumerate(self.data.first)]
                columns.append((self._with_twin(self._gather(made)), float(tell[c])))
        return columns

    def random_power(self, terms: Sequence[Term]) -> np.ndarray:
        """PSD that random effects add, flattened."""
        total = np.zeros(len(self.base))
        for term in terms:
            total += self._with_twin(self._gather(random_effects.power(self.data, term)).real)
        return total

    def likelihood(self, values: np.ndarray, added: np.ndarray | float = 0.0) -> float:
        """Log likelihood of what is left, over nothing in particular; only differences mean something."""
        return float(self.each(values, added).sum())

    def each(self, values: np.ndarray, added: np.ndarray | float = 0.0) -> np.ndarray:
        power = self.power + added
        e = np.abs(values) ** 2 / power
        tails = (self.freedom + 1.0) * np.log1p(e / self.tail)
        return np.where(self.known, -OVERLAP_WEIGHT * (np.log(power) + tails), 0.0)


def tail(freedom: np.ndarray) -> np.ndarray:
    """Scale (n,) of tails whose likelihood is highest at the mean of exponential power: E[(nu + 1) e / (tail + e)] = 1."""
    return np.array([_tail(nu) for nu in np.unique(freedom)])[np.unique(freedom, return_inverse=True)[1]] \
        if len(freedom) else freedom


@functools.cache
def _tail(nu: float) -> float:
    return float(brentq(lambda a: a * np.exp(a) * exp1(a) - nu / (nu + 1.0), 1e-3, 600.0))


def problem_of(data: Data, part: Part) -> Problem:
    """The flattened blocks of a part, made once."""
    kept = data.__dict__.setdefault("_problems", {})
    if id(part) not in kept:
        kept[id(part)] = (part, Problem(data, part))
    return kept[id(part)][1]


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
    random = [t for t in terms if t.kind == SPECTRUM]
    active = [t.active() for t in terms if t.kind == MEAN]
    told, cost = problem.commanded([*active, *(t.active() for t in random)], wide or bool(random))
    added = problem.random_power(random) + told
    values, penalty = _without_offsets(problem, problem.values(active), added)
    return problem, values, added, penalty + cost


def _start(problem: Problem, mean: Sequence[Term]) -> np.ndarray:
    """Close to neutral; effects of the commands alone where their likelihood is highest on a coarse grid."""
    x = np.concatenate([np.full(len(t.free), 0.05) for t in mean]) if mean else np.zeros(0)
    place = 0
    for t in mean:
        here = range(place, place + len(t.free))
        place += len(t.free)
        if t.name not in LOOP or not len(problem.twin):
            continue
        low, high = _limits(mean)
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


def _limits(mean: Sequence[Term]) -> tuple[np.ndarray, np.ndarray]:
    pairs = [t.bounds() for t in mean]
    return (np.concatenate([p[0] for p in pairs]), np.concatenate([p[1] for p in pairs])) if pairs \
        else (np.zeros(0), np.zeros(0))


def _weights(problem: Problem, values: np.ndarray, added: np.ndarray | float) -> np.ndarray:
    power = problem.power + added
    e = np.abs(values) ** 2 / power
    return OVERLAP_WEIGHT * (problem.freedom + 1.0) / (problem.tail + e) / power * problem.known


def _solve(columns: list[np.ndarray], prior: np.ndarray, values: np.ndarray, weights: np.ndarray,
           at: np.ndarray, twin: tuple[np.ndarray, np.ndarray] | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Step of ridge regression that lowers values + sum(step * column), and the covariance.

    twin: gradient and information of the likelihood from the commands' spectra.
    """
    normal, slope = _normal(columns, prior, values, weights, at, twin)
    covariance = np.linalg.pinv(normal, hermitian=True)
    return covariance @ slope, covariance


def _normal(columns: list[np.ndarray], prior: np.ndarray, values: np.ndarray, weights: np.ndarray, at: np.ndarray,
            twin: tuple[np.ndarray, np.ndarray] | None) -> tuple[np.ndarray, np.ndarray]:
    """Normal matrix and right-hand side of that ridge regression."""
    j = np.array(columns)
    wj = j.conj() * weights
    normal = 2.0 * (wj @ j.T).real + np.diag(1.0 / prior ** 2)
    slope = -2.0 * (wj @ values).real - at / prior ** 2
    if twin is not None:
        slope, normal = slope + twin[0], normal + twin[1]
    return normal, slope


def _bounded_step(columns: list[np.ndarray], prior: np.ndarray, values: np.ndarray, weights: np.ndarray,
                  x: np.ndarray, offsets: np.ndarray, low: np.ndarray, high: np.ndarray,
                  twin: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """A step that leaves parameters at a bound there when it would take them past it."""
    at, n = np.concatenate([x, offsets]), len(x)
    free = np.ones(len(at), bool)
    covariance = np.zeros((n, n))
    gradient, information = np.zeros(len(at)), np.zeros((len(at), len(at)))
    gradient[:n], information[:n, :n] = twin
    normal, slope = _normal(columns, prior, values, weights, at, (gradient, information))
    for _ in range(n + 1):
        change = np.zeros(len(at))
        where = np.flatnonzero(free)
        if not len(where):
            break
        full = np.linalg.pinv(normal[np.ix_(where, where)], hermitian=True)
        change[where] = full @ slope[where]
        stuck = np.zeros(len(at), bool)
        stuck[:n] = free[:n] & (((x <= low) & (change[:n] < 0.0)) | ((x >= high) & (change[:n] > 0.0)))
        if not stuck.any():
            inside = where[where < n]
            covariance[np.ix_(inside, inside)] = full[:len(inside), :len(inside)]
            break
        free &= ~stuck
    return change, covariance


def _gauss_newton(problem: Problem, mean: Sequence[Term], x: np.ndarray, added: np.ndarray | float,
                  spread: np.ndarray | float, wide: bool,
                  ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Scaled parameters, offsets, covariance of the parameters, and what is left."""
    constants = problem.constant()
    low, high = _limits(mean)
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
    cost = price + _cost(problem, values, added + told, x, offsets, prior)
    for _ in range(ITERATIONS):
        columns, others = [], []
        for i in range(len(x)):
            step = 0.02 if x[i] + 0.02 <= high[i] else -0.02
            moved = x.copy()
            moved[i] += step
            others.append((_active(mean, moved), step))
            columns.append((problem.values(others[-1][0]) - raw) / step)
        columns += [-c for c, _ in constants]
        change, covariance = _bounded_step(
            columns, prior, values, _weights(problem, values, added + told), x, offsets, low, high,
            problem.twin.slopes(_active(mean, x), others, wide))
        scale, better = 1.0, False
        while scale > 0.05:
            new_x = np.clip(x + scale * change[:len(x)], low, high)
            new_o = offsets + scale * change[len(x):]
            new_raw = problem.values(_active(mean, new_x)) if mean else problem.base
            new_values = new_raw - push(new_o)
            new_told, price = problem.commanded(_active(mean, new_x), wide)
            new_cost = price + _cost(problem, new_values, added + new_told, new_x, new_o, prior)
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


def _cost(problem: Problem, values: np.ndarray, added: np.ndarray | float, x: np.ndarray,
          offsets: np.ndarray, prior: np.ndarray) -> float:
    return -problem.likelihood(values, added) + 0.5 * float(((np.concatenate([x, offsets]) / prior) ** 2).sum())


def _without_offsets(problem: Problem, values: np.ndarray, added: np.ndarray | float,
                     ) -> tuple[np.ndarray, float]:
    constants = problem.constant()
    if not constants:
        return values, 0.0
    prior, found = np.array([p for _, p in constants]), np.zeros(len(constants))
    left = values
    for _ in range(2):
        step, _ = _solve([-c for c, _ in constants], prior, left, _weights(problem, left, added), found)
        found = found + step
        left = values - sum(a * c for a, (c, _) in zip(found, constants, strict=True))
    return left, 0.5 * float(((found / prior) ** 2).sum())


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
    """Variance (k, k) of a random effect's scaled strength, from the likelihood's curvature; inf where there is none."""
    x, step = term.scaled(term.values), 0.15
    at = []
    for amount in (-step, 0.0, step):
        moved = term.fitted(x * np.exp(amount))
        at.append(judge(data, part, [moved if t is term else t for t in terms]))
    bend = (2.0 * at[1] - at[0] - at[2]) / step ** 2
    return np.diag(x ** 2 / max(bend, 1e-6))
