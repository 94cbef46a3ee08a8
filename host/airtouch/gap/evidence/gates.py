"""Effects that come and go: when each acts, found block by block, and what that explains.

An effect is fitted to the blocks that are explained worst. Stretches are then those in which it gains more log
likelihood than the choice of a stretch costs, log n + log n for its ends among n blocks; both steps are repeated.
A stretch may lie in one half of a split, so a gated effect is judged on what it is fitted on, at the price of half
the logarithm of the number of blocks for each parameter (Schwarz 1978).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import Fit, fit, judge, left_over
from airtouch.gap.evidence.problem import Part, Problem, problem_of, whole_of
from airtouch.gap.flights.filters import both_ways, highpass
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.signals.channels import residual
from airtouch.gap.signals.spectra import AIR, LENGTH
from airtouch.gap.signatures import candidates
from airtouch.gap.signatures.candidates import random_of
from airtouch.gap.signatures.signature import OVERHEAD
from airtouch.gap.signatures.term import Term
from airtouch.logs.segments import KINDS

#: no number here has a source unless it says so: all were chosen
MOST_STRETCHES = 4  #: stretches of one flight in which an effect may act
WORST = 0.25  #: share of the blocks, those explained worst, that an effect is first fitted to
ROUNDS = 3  #: rounds of fitting an effect and choosing its stretches
LEAST_BLOCKS = 6  #: blocks in the air, below which no stretch is sought
STEPS_S = (0.64, 0.32, 0.16, 0.08)  #: by which the ends of a stretch are moved
PIECE_S = 0.16  #: s, length of the pieces of the force along the thrust in which bursts are sought
LIVELY_HZ = 1.0  #: frequency above which a burst shows
LIVELY, DEGREES = 6.0, 3.0  #: power of a burst over the flight's median; independent values in a piece
#: phases in which the floor's own air acts, and no two flights are alike: no stretch lies there
ENDS = (KINDS.index("take-off"), KINDS.index("landing"))
TOLD = "told"  #: a wake in seconds in which another vehicle is known to be overhead
WHOLE = 0.9  #: share of a flight's blocks above which an effect does not come and go
Gate = tuple[tuple[str, float, float], ...]


@dataclass(frozen=True)
class Gated:
    """An effect as fitted in its stretches, what it gains after all costs, and what the choice of them costs."""

    name: str
    fitted: Fit
    gain: float
    cost: float
    key: str  #: of `Scatter.passing`, what nominal flights have of it: the effect's name, or TOLD

    @property
    def strength(self) -> np.ndarray:
        """Scaled parameters (k,) of all its terms."""
        return np.concatenate([t.scaled(t.values) for t in self.fitted.terms])


def gated(data: Data, without: Sequence[str] = ()) -> dict[str, Gated]:
    """Effects that may come and go, each in the stretches in which it explains most; not those that never act.

    Where another vehicle is known to be overhead, what it does there is one more, TOLD.
    """
    whole = whole_of(data)
    without_effect = _each(data, whole, ())
    if len(without_effect) < LEAST_BLOCKS:
        return {}
    level, bursts = {wide: judge(data, whole, (), wide) for wide in (False, True)}, _bursts(data)
    out = {}
    for name, variants in candidates.gated(without).items():
        if name == OVERHEAD and data.study.overhead:
            wake = _best(data, whole, name, variants, data.study.overhead, level, len(without_effect))
            out[TOLD] = replace(wake, key=TOLD)
        judged = [_judged(data, whole, name, terms, gate, cost, level, len(without_effect)) for variant in variants
                  for terms, gate, cost in (_by_blocks(data, whole, without_effect, variant), (variant, *bursts))
                  if gate]
        if judged:
            out[name] = max(judged, key=lambda j: j.gain)
    return out


def within(data: Data, name: str, gate: Gate) -> Gated | None:
    """An effect that acts within a gate that nobody chose; None in a flight that is too short to say."""
    whole = whole_of(data)
    blocks = len(_each(data, whole, ()))
    if blocks < LEAST_BLOCKS:
        return None
    level = {wide: judge(data, whole, (), wide) for wide in (False, True)}
    return _best(data, whole, name, candidates.gated()[name], gate, level, blocks)


def _best(data: Data, whole: Part, name: str, variants: Sequence[Sequence[Term]], gate: Gate,
          level: dict[bool, float], blocks: int) -> Gated:
    """The variant of an effect that gains most within a gate that costs nothing, as nobody chose it."""
    return max((_judged(data, whole, name, v, gate, 0.0, level, blocks) for v in variants), key=lambda j: j.gain)


def _judged(data: Data, whole: Part, name: str, terms: Sequence[Term], gate: Gate, cost: float,
            level: dict[bool, float], blocks: int) -> Gated:
    """An effect fitted within a gate, whose choice costs `cost`.

    level: log likelihood without any effect, as sure of the commands' floor as without and with random ones.
    """
    acting = [replace(t, gate=gate) for t in terms]
    fitted = fit(data, whole, acting)
    free = sum(len(t.free) for t in acting)
    without = level[bool(random_of(acting))]
    gain = judge(data, whole, fitted.terms) - without - cost - 0.5 * free * np.log(blocks)
    return Gated(name, fitted, gain, cost, name)


def _by_blocks(data: Data, whole: Part, off: np.ndarray, terms: Sequence[Term]) -> tuple[Sequence[Term], Gate, float]:
    """An effect fitted, the stretches of blocks (off: their log likelihood without it) where it acts, and their price.

    No stretch where it acts nowhere or everywhere.
    """
    problem, blocks = problem_of(data, whole), len(off)
    count = np.maximum(np.bincount(problem.block[problem.block >= 0], minlength=blocks), 1)
    on = np.zeros(blocks, bool)
    on[np.argsort(off / count)[:max(int(WORST * blocks), 2)]] = True
    for _ in range(ROUNDS):
        fitted = fit(data, _part(whole, on), terms)
        gain = np.where(_at_the_ends(data, problem), -np.inf, _each(data, whole, fitted.terms) - off)
        stretches = _stretches(gain, problem.piece, 2.0 * np.log(blocks))
        chosen = np.zeros(blocks, bool)
        for first, last in stretches:
            chosen[first:last + 1] = True
        if not stretches or chosen.mean() > WHOLE:
            return terms, (), 0.0
        if (chosen == on).all():
            break
        on = chosen
    gate = tuple((data.flights[problem.piece[a]].name, *_seconds(data, problem, a, b)) for a, b in stretches)
    return fitted.terms, _sharpened(data, whole, fitted.terms, gate), 2.0 * np.log(blocks) * len(stretches)


def _bursts(data: Data) -> tuple[Gate, float]:
    """Stretches in which the force along the thrust is far more lively than in the rest of the flight, and their price.

    A wake that is flown through lasts shorter than a block. A piece of PIECE_S counts the log likelihood of a power
    that is LIVELY times the flight's median over that of the median (chi-square of DEGREES), as if it were no more.
    """
    gate, price = [], 0.0
    for flight in data.flights:
        force = np.nan_to_num(residual(flight, data.study.vehicle, data.study.calibration)[:, 2])
        force[flight.on_ground | flight.bridged | np.isin(flight.phase, ENDS)] = 0.0
        size = int(PIECE_S / PERIOD_S)
        pieces = _highpassed(force)[:len(force) // size * size].reshape(-1, size)
        power = (pieces ** 2).mean(axis=1)
        known = power > 0.0
        if known.sum() < 2 * LEAST_BLOCKS:
            continue
        over = np.minimum(power / np.median(power[known]), LIVELY)
        gain = np.where(known, 0.5 * DEGREES * (over * (1.0 - 1.0 / LIVELY) - np.log(LIVELY)), -np.inf)
        each = 2.0 * np.log(known.sum())
        stretches = _stretches(gain, np.zeros(len(gain), int), each)
        gate += [(flight.name, a * PIECE_S, (b + 1) * PIECE_S) for a, b in stretches]
        price += each * len(stretches)
    seconds = sum(end - begin for _, begin, end in gate)
    whole = seconds > WHOLE * sum(len(f) for f in data.flights) * PERIOD_S
    return ((), 0.0) if whole else (tuple(gate), price)


def _highpassed(values: np.ndarray) -> np.ndarray:
    """Values (n,) freed of what is slower than LIVELY_HZ."""
    return both_ways(highpass(LIVELY_HZ * 2.0 * PERIOD_S), values)


def _at_the_ends(data: Data, problem: Problem) -> np.ndarray:
    """Blocks (b,) in the air most of which are take-off or landing."""
    ends = [np.isin(data.flights[i].phase[first:first + LENGTH[AIR]], ENDS).mean() > 0.5
            for i, first in zip(problem.piece, problem.begin, strict=True)]
    return np.array(ends, bool)


def _sharpened(data: Data, whole: Part, terms: Sequence[Term], gate: Gate) -> Gate:
    """The gate with each end moved by less and less, as long as the likelihood grows."""

    def level(gate_tried: Gate) -> float:
        """Log likelihood with the effect in a gate."""
        return judge(data, whole, [replace(t, gate=gate_tried) for t in terms])

    best = level(gate)
    for step in STEPS_S:
        for i in range(len(gate)):
            for end in (0, 1):
                for sign in (-1.0, 1.0):
                    flight, *ends = gate[i]
                    ends[end] += sign * step
                    begin, stop = ends
                    gate_tried = (*gate[:i], (flight, begin, stop), *gate[i + 1:])
                    if begin < stop and (gain := level(gate_tried)) > best:
                        best, gate = gain, gate_tried
    return gate


def _each(data: Data, part: Part, terms: Sequence[Term]) -> np.ndarray:
    """Log likelihood (b,) of every block in the air under a hypothesis."""
    problem, values, power = left_over(data, part, terms)
    each = problem.each(values, power - problem.power)
    in_air = problem.block >= 0
    return np.bincount(problem.block[in_air], each[in_air])


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
    remaining, out = gain.copy(), []
    while len(out) < MOST_STRETCHES * (int(flight.max()) + 1):
        best, stretch = price, None
        total, begin = 0.0, 0
        for k in range(len(remaining)):
            if total <= 0.0 or (k and flight[k] != flight[k - 1]):
                total, begin = 0.0, k
            total += remaining[k]
            if total > best:
                best, stretch = total, (begin, k)
        if stretch is None:
            break
        out.append(stretch)
        remaining[stretch[0]:stretch[1] + 1] = -np.inf
    return sorted(out)


def _seconds(data: Data, problem, first: int, last: int) -> tuple[float, float]:
    """From when to when a stretch of blocks lasts: without the outer quarters, which hardly count in its spectra."""
    begin, quarter = problem.begin, LENGTH[AIR] // 4
    return float((begin[first] + quarter) * PERIOD_S), float((begin[last] + LENGTH[AIR] - quarter) * PERIOD_S)


