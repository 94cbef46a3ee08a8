"""The search for the gate of an effect: intervals of blocks in which it gains more than their choice costs."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import fit
from airtouch.gap.evidence.judge import judge, judged_blocks
from airtouch.gap.evidence.layout import AirBlocks
from airtouch.gap.evidence.problem import BlockSet, problem_of
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.signals.spectra import AIR, LENGTH
from airtouch.gap.signatures.term import Term
from airtouch.logs.segments import KINDS
from airtouch.simulation.effects.effect import Gate

# No number here has a source: all were chosen.
#: intervals of an effect at most, times the number of flights, of all flights together; a larger number lets one act in
#: many short intervals
MOST_INTERVALS = 4
#: fraction of the blocks, those explained worst, that an effect is first fitted to; with a larger number an effect of
#: few seconds is first fitted to blocks in which it does not act as well
WORST_FRACTION = 0.25
LEAST_WORST = 2  #: blocks that it is first fitted to at least; a larger number does the same in short flights
SEARCH_ROUNDS = 3  #: rounds of fitting an effect and choosing its intervals, at most; a larger number takes more time
LEAST_BLOCKS = 6  #: blocks in the air, below which no gate is sought; a larger number seeks none in short flights
#: s by which the ends of an interval are moved, in this order; the largest says how far they may go, the smallest how
#: finely they are placed
STEPS_S = (0.64, 0.32, 0.16, 0.08)
#: fraction of the blocks in the air, and of the pieces that count (`bursts`), above which an effect is no passing one;
#: a larger number lets one pass that acts nearly all along
MOST_OF_FLIGHTS = 0.9
#: phases in which the air near the ground acts, and no two flights are alike: no interval is made of blocks that lie
#: there for the most part. Its ends may reach into these phases, when they are moved too
ENDS = (KINDS.index("take-off"), KINDS.index("landing"))


class GateTrial(NamedTuple):
    """An effect to be tried in a gate, () where it is no passing effect; cost: nats, of the gate's choice."""

    terms: Sequence[Term]
    gate: Gate
    cost: float


def block_gate(data: Data, whole: BlockSet, null_log_likelihoods: np.ndarray, terms: Sequence[Term]) -> GateTrial:
    """An effect as fitted where it acts, with the gate of the blocks in which it does.

    No gate where it acts nowhere or everywhere. whole: all blocks of the flights; null_log_likelihoods (b,): of each
    in the air, without the effect. The effect is fitted to the blocks that are explained worst, then to those in
    which it gains, SEARCH_ROUNDS times at most; then the intervals' ends are moved.
    """
    air, cost = problem_of(data, whole).flat.air, interval_cost(len(null_log_likelihoods))
    at_the_ends = _at_the_ends(data, air)
    acting = _explained_worst(air, null_log_likelihoods)
    for _ in range(SEARCH_ROUNDS):
        fitted = fit(data, _part(whole, acting), terms)
        gain = np.where(at_the_ends, -np.inf, block_log_likelihoods(data, whole, fitted.terms) - null_log_likelihoods)
        intervals = best_intervals(gain, air.flight, cost)
        chosen = np.zeros(len(null_log_likelihoods), bool)
        for first, last in intervals:
            chosen[first:last + 1] = True
        if not intervals or chosen.mean() > MOST_OF_FLIGHTS:
            return GateTrial(terms, (), 0.0)
        if (chosen == acting).all():
            break
        acting = chosen
    gate = tuple((data.flights[air.flight[a]].name, *_ends_s(air, a, b)) for a, b in intervals)
    return GateTrial(fitted.terms, _sharpen(data, whole, fitted.terms, gate), cost * len(intervals))


def interval_cost(count: int) -> float:
    """Nats that the choice of one interval among so many blocks or pieces costs: log n for each of its ends."""
    return 2.0 * np.log(count)


def best_intervals(gain: np.ndarray, flight: np.ndarray, cost: float) -> list[tuple[int, int]]:
    """Disjoint intervals (first, last) of blocks of one flight with the largest sums of gain, each over its cost.

    gain (b,): nats of each block; flight (b,): its flight's number; cost: nats of each interval. There are at most
    MOST_INTERVALS times the number of flights.
    """
    remaining, out = gain.copy(), []
    while len(out) < MOST_INTERVALS * (int(flight.max()) + 1):
        interval = _best_interval(remaining, flight, cost)
        if interval is None:
            break
        out.append(interval)
        remaining[interval[0]:interval[1] + 1] = -np.inf
    return sorted(out)


def _best_interval(gain: np.ndarray, flight: np.ndarray, cost: float) -> tuple[int, int] | None:
    """The interval (first, last) of the largest sum of gain over a cost, in one pass (Kadane); None without one."""
    best, interval = cost, None
    total, begin = 0.0, 0
    for k in range(len(gain)):
        if total <= 0.0 or (k and flight[k] != flight[k - 1]):
            total, begin = 0.0, k
        total += gain[k]
        if total > best:
            best, interval = total, (begin, k)
    return interval


def block_log_likelihoods(data: Data, part: BlockSet, terms: Sequence[Term]) -> np.ndarray:
    """Log likelihood (b,) of every block in the air under effects."""
    judged = judged_blocks(data, part, terms)
    flat = judged.problem.flat
    block, per_value = flat.air.block_of_value, judged.log_likelihoods()[:flat.replay_count]
    in_air = block >= 0
    return np.bincount(block[in_air], per_value[in_air])


def _explained_worst(air: AirBlocks, null_log_likelihoods: np.ndarray) -> np.ndarray:
    """Which blocks (b,) are explained worst: WORST_FRACTION of them, of the least log likelihood of a value."""
    in_air = air.block_of_value[air.block_of_value >= 0]
    blocks = len(null_log_likelihoods)
    values = np.maximum(np.bincount(in_air, minlength=blocks), 1)
    out = np.zeros(blocks, bool)
    out[np.argsort(null_log_likelihoods / values)[:max(int(WORST_FRACTION * blocks), LEAST_WORST)]] = True
    return out


def _at_the_ends(data: Data, air: AirBlocks) -> np.ndarray:
    """Blocks (b,) in the air most of which are take-off or landing."""
    ends = [np.isin(data.flights[i].phase[first:first + LENGTH[AIR]], ENDS).mean() > 0.5
            for i, first in zip(air.flight, air.begin, strict=True)]
    return np.array(ends, bool)


def _part(whole: BlockSet, acting: np.ndarray) -> BlockSet:
    """The blocks in the air in which an effect acts. acting (b,): whether it does in each."""
    pieces, place = [], 0
    for flight, state, chosen in whole.pieces:
        if state == AIR:
            pieces.append((flight, state, acting[place:place + len(chosen)]))
            place += len(chosen)
    return BlockSet(tuple(pieces))


def _ends_s(air: AirBlocks, first: int, last: int) -> tuple[float, float]:
    """Ends of an interval of blocks, s: without the outer quarters, which hardly count in its spectra."""
    quarter = LENGTH[AIR] // 4
    return float((air.begin[first] + quarter) * PERIOD_S), float((air.begin[last] + LENGTH[AIR] - quarter) * PERIOD_S)


def _sharpen(data: Data, whole: BlockSet, terms: Sequence[Term], gate: Gate) -> Gate:
    """The gate with each end moved by less and less, as long as the likelihood grows and no intervals overlap."""

    def log_likelihood(of_gate: Gate) -> float:
        """Log likelihood with the effect in a gate."""
        return judge(data, whole, [replace(t, gate=of_gate) for t in terms])

    best = log_likelihood(gate)
    for step, i, end, sign in itertools.product(STEPS_S, range(len(gate)), (0, 1), (-1.0, 1.0)):
        moved = _move_end(gate, i, end, sign * step)
        if _is_disjoint(moved) and (gain := log_likelihood(moved)) > best:
            best, gate = gain, moved
    return gate


def _move_end(gate: Gate, i: int, end: int, by_s: float) -> Gate:
    """A gate with one end (0: begin, 1: end) of its interval i moved."""
    flight, *ends = gate[i]
    ends[end] += by_s
    return (*gate[:i], (flight, ends[0], ends[1]), *gate[i + 1:])


def _is_disjoint(gate: Gate) -> bool:
    """Whether every interval of a gate (in order of flight and time) ends after its begin and before the next one."""
    return (all(begin < end for _, begin, end in gate)
            and all(a[0] != b[0] or a[2] <= b[1] for a, b in itertools.pairwise(gate)))
