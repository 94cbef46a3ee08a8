"""Effects that come and go: when each acts, found block by block, and what that explains.

An effect is fitted to the blocks that are explained worst. Stretches are then those in which it gains more log
likelihood than the choice of a stretch costs, log n + log n for its ends among n blocks; both steps are repeated.
A stretch may lie in one half of a split, so a gated effect is judged on what it is fitted on, at the price of half
the logarithm of the number of blocks for each parameter (Schwarz 1978).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from airtouch.gap import candidates
from airtouch.gap.candidates import Term
from airtouch.gap.data import Data
from airtouch.gap.fit import Fit, fit, judge, left_over
from airtouch.gap.flight import PERIOD_S
from airtouch.gap.problem import Part, problem_of, whole_of
from airtouch.gap.spectra import AIR, LENGTH

MOST_STRETCHES = 4  #: of one flight
WORST = 0.25  #: share of the blocks that are explained worst
ROUNDS = 3
LEAST_BLOCKS = 6  #: in the air
STEPS_S = (0.64, 0.32, 0.16, 0.08)  #: by which the ends of a stretch are moved
Gate = tuple[tuple[str, float, float], ...]
WHOLE = 0.9  #: of a flight's blocks: what acts there does not come and go


@dataclass(frozen=True)
class Gated:
    """An effect as fitted in its stretches, what it gains after all costs, and what the choice of them costs."""

    name: str
    fitted: Fit
    gain: float
    cost: float


def best_gated(data: Data, without: Sequence[str] = ()) -> Gated | None:
    """The effect that explains most by acting in some stretches only; None where none gains anything."""
    judged = [j for name, variants in candidates.gated(without).items() for v in variants
              if (j := _judged(data, name, v)) is not None]
    return max(judged, key=lambda j: j.gain, default=None)


def _judged(data: Data, name: str, terms: Sequence[Term]) -> Gated | None:
    whole = whole_of(data)
    problem = problem_of(data, whole)
    off = _each(data, whole, ())
    blocks = len(off)
    if blocks < LEAST_BLOCKS:
        return None
    count = np.maximum(np.bincount(problem.block[problem.block >= 0], minlength=blocks), 1)
    on = np.zeros(blocks, bool)
    on[np.argsort(off / count)[:max(int(WORST * blocks), 2)]] = True
    fitted, cost = None, 0.0
    for _ in range(ROUNDS):
        fitted = fit(data, _part(whole, on), terms)
        gain = _each(data, whole, fitted.terms) - off
        stretches = _stretches(gain, problem.piece, 2.0 * np.log(blocks))
        chosen = np.zeros(blocks, bool)
        for first, last in stretches:
            chosen[first:last + 1] = True
        if not stretches or chosen.mean() > WHOLE:
            return None
        cost = 2.0 * np.log(blocks) * len(stretches)
        if (chosen == on).all():
            break
        on = chosen
    gate = tuple((data.flights[problem.piece[a]].name, *_seconds(data, problem, a, b)) for a, b in stretches)
    gate = _sharpened(data, whole, fitted.terms, gate)
    gated = [replace(t, gate=gate) for t in fitted.terms]
    refitted = fit(data, whole, gated, fitted.scaled if len(fitted.scaled) else None)
    free = sum(len(t.free) for t in gated)
    gained = judge(data, whole, refitted.terms) - judge(data, whole, ()) - cost
    gained -= 0.5 * free * np.log(blocks)
    return Gated(name, refitted, gained, cost)


def _sharpened(data: Data, whole: Part, terms: Sequence[Term], gate: Gate) -> Gate:
    """The gate with each end moved by less and less, as long as the likelihood grows."""
    level = lambda tried: judge(data, whole, [replace(t, gate=tried) for t in terms])
    best = level(gate)
    for step in STEPS_S:
        for i in range(len(gate)):
            for end in (1, 2):
                for sign in (-1.0, 1.0):
                    moved = list(gate[i])
                    moved[end] += sign * step
                    tried = (*gate[:i], tuple(moved), *gate[i + 1:])
                    if moved[1] < moved[2] and (found := level(tried)) > best:
                        best, gate = found, tried
    return gate


def _each(data: Data, part: Part, terms: Sequence[Term]) -> np.ndarray:
    """Log likelihood (b,) of every block in the air under a hypothesis."""
    problem, values, power = left_over(data, part, terms)
    each = problem.each(values, power - problem.power)
    here = problem.block >= 0
    return np.bincount(problem.block[here], each[here])


def _part(whole: Part, on: np.ndarray) -> Part:
    """The blocks in the air that are on."""
    pieces, place = [], 0
    for flight, regime, chosen in whole.pieces:
        if regime == AIR:
            pieces.append((flight, regime, on[place:place + len(chosen)]))
            place += len(chosen)
    return Part(tuple(pieces))


def _stretches(gain: np.ndarray, flight: np.ndarray, price: float) -> list[tuple[int, int]]:
    """Disjoint stretches (first, last) of blocks of one flight with the largest sums of gain, each over its price."""
    left, out = gain.copy(), []
    while len(out) < MOST_STRETCHES * (int(flight.max()) + 1):
        best, found = price, None
        total, begin = 0.0, 0
        for k in range(len(left)):
            if total <= 0.0 or (k and flight[k] != flight[k - 1]):
                total, begin = 0.0, k
            total += left[k]
            if total > best:
                best, found = total, (begin, k)
        if found is None:
            break
        out.append(found)
        left[found[0]:found[1] + 1] = -np.inf
    return sorted(out)


def _seconds(data: Data, problem, first: int, last: int) -> tuple[float, float]:
    """From when to when a stretch of blocks lasts: without the outer quarters, which hardly count in its spectra."""
    begin, quarter = problem.begin, LENGTH[AIR] // 4
    return float((begin[first] + quarter) * PERIOD_S), float((begin[last] + LENGTH[AIR] - quarter) * PERIOD_S)


