"""When an effect acts: stretches of blocks in which it gains more than their choice costs."""

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

#: no number here has a source: all were chosen
MOST_STRETCHES = 4  #: stretches in which an effect may act, times the number of flights, of all flights together
WORST = 0.25  #: share of the blocks, those explained worst, that an effect is first fitted to
LEAST_WORST = 2  #: blocks that it is first fitted to at least
STRETCH_ROUNDS = 3  #: rounds of fitting an effect and choosing its stretches
LEAST_BLOCKS = 6  #: blocks in the air, below which no stretch is sought
STEPS_S = (0.64, 0.32, 0.16, 0.08)  #: by which the ends of a stretch are moved
WHOLE = 0.9  #: fraction of all flights' blocks in the air, above which an effect is no passing one
#: phases in which the floor's own air acts, and no two flights are alike: no stretch lies there
ENDS = (KINDS.index("take-off"), KINDS.index("landing"))


class GateTrial(NamedTuple):
    """An effect to be tried in a gate, none where it is no passing effect; cost: nats, of the gate's choice."""

    terms: Sequence[Term]
    gate: Gate
    cost: float


def stretches_of(data: Data, whole: BlockSet, level_without: np.ndarray, terms: Sequence[Term]) -> GateTrial:
    """An effect as fitted where it acts, with the stretches of blocks in which it does.

    No gate where it acts nowhere or everywhere. whole: all blocks of the flights; level_without (b,): log likelihood of
    each in the air without the effect. The effect is fitted to the blocks that are explained worst, then to those in
    which it gains, STRETCH_ROUNDS times at most; then the stretches' ends are moved.
    """
    air, cost = problem_of(data, whole).flat.air, cost_of_stretch(len(level_without))
    at_the_ends = _at_the_ends(data, air)
    acting = _explained_worst(air, level_without)
    for _ in range(STRETCH_ROUNDS):
        fitted = fit(data, _part(whole, acting), terms)
        gain = np.where(at_the_ends, -np.inf, each_block(data, whole, fitted.terms) - level_without)
        stretches = best_stretches(gain, air.flight, cost)
        chosen = np.zeros(len(level_without), bool)
        for first, last in stretches:
            chosen[first:last + 1] = True
        if not stretches or chosen.mean() > WHOLE:
            return GateTrial(terms, (), 0.0)
        if (chosen == acting).all():
            break
        acting = chosen
    gate = tuple((data.flights[air.flight[a]].name, *_seconds(air, a, b)) for a, b in stretches)
    return GateTrial(fitted.terms, _sharpen(data, whole, fitted.terms, gate), cost * len(stretches))


def cost_of_stretch(blocks: int) -> float:
    """Nats that the choice of one stretch among so many blocks costs: log n for each of its ends."""
    return 2.0 * np.log(blocks)


def best_stretches(gain: np.ndarray, flight: np.ndarray, cost: float) -> list[tuple[int, int]]:
    """Disjoint stretches (first, last) of blocks of one flight with the largest sums of gain, each over its cost.

    gain (b,): nats of each block; flight (b,): its flight's number; cost: nats of each stretch. There are at most
    MOST_STRETCHES times the number of flights.
    """
    remaining, out = gain.copy(), []
    while len(out) < MOST_STRETCHES * (int(flight.max()) + 1):
        stretch = _best_stretch(remaining, flight, cost)
        if stretch is None:
            break
        out.append(stretch)
        remaining[stretch[0]:stretch[1] + 1] = -np.inf
    return sorted(out)


def _best_stretch(gain: np.ndarray, flight: np.ndarray, cost: float) -> tuple[int, int] | None:
    """The stretch (first, last) of the largest sum of gain over a cost, in one pass (Kadane); None without one."""
    best, stretch = cost, None
    total, begin = 0.0, 0
    for k in range(len(gain)):
        if total <= 0.0 or (k and flight[k] != flight[k - 1]):
            total, begin = 0.0, k
        total += gain[k]
        if total > best:
            best, stretch = total, (begin, k)
    return stretch


def each_block(data: Data, part: BlockSet, terms: Sequence[Term]) -> np.ndarray:
    """Log likelihood (b,) of every block in the air under a hypothesis."""
    judged = judged_blocks(data, part, terms)
    flat = judged.problem.flat
    block, levels = flat.air.block_of_value, judged.log_likelihoods()[:flat.replay_count]
    in_air = block >= 0
    return np.bincount(block[in_air], levels[in_air])


def _explained_worst(air: AirBlocks, level_without: np.ndarray) -> np.ndarray:
    """Which blocks (b,) are explained worst: a share WORST of them, of the least log likelihood of a value."""
    in_air = air.block_of_value[air.block_of_value >= 0]
    count = np.maximum(np.bincount(in_air, minlength=len(level_without)), 1)
    out = np.zeros(len(level_without), bool)
    out[np.argsort(level_without / count)[:max(int(WORST * len(level_without)), LEAST_WORST)]] = True
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


def _seconds(air: AirBlocks, first: int, last: int) -> tuple[float, float]:
    """From when to when a stretch of blocks lasts, s: without the outer quarters, which hardly count in its spectra."""
    quarter = LENGTH[AIR] // 4
    return float((air.begin[first] + quarter) * PERIOD_S), float((air.begin[last] + LENGTH[AIR] - quarter) * PERIOD_S)


def _sharpen(data: Data, whole: BlockSet, terms: Sequence[Term], gate: Gate) -> Gate:
    """The gate with each end moved by less and less, as long as the likelihood grows."""

    def level(tried: Gate) -> float:
        """Log likelihood with the effect in a gate."""
        return judge(data, whole, [replace(t, gate=tried) for t in terms])

    best = level(gate)
    for step, i, end, sign in itertools.product(STEPS_S, range(len(gate)), (0, 1), (-1.0, 1.0)):
        moved = _move_end(gate, i, end, sign * step)
        if moved[i][1] < moved[i][2] and (gain := level(moved)) > best:
            best, gate = gain, moved
    return gate


def _move_end(gate: Gate, i: int, end: int, by_s: float) -> Gate:
    """A gate with one end (0: begin, 1: end) of its stretch i moved."""
    flight, *ends = gate[i]
    ends[end] += by_s
    return (*gate[:i], (flight, ends[0], ends[1]), *gate[i + 1:])
