"""How far an effect closes the gap, on data that it was not fitted to.

A **power ratio** is the power of one value of the spectra over that expected of it: 1 on average where nothing acts.
The **gap** is the root of the mean power ratio over some cells (channel by band by view), so that its floor is 1. The
cells are those in which the other half of the data shows a gap, or in which the effects named gain there. The
**shrink** is the fraction of the gap above the floor that effects in the model close.

Where the effects named leave power ratios below 1 on average, the flights were flown in calmer air than nominal ones.
What is missing, the **deficit**, is added to every power ratio before and after: the floor of these flights is lower,
and what lies below 1 is not counted as closed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.evidence.cells import CELLS
from airtouch.gap.evidence.clock import nominal_time_rms_s
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.judge import CELL_GAIN, JudgedBlocks, cell_gains, judged_blocks
from airtouch.gap.evidence.problem import BlockSet
from airtouch.gap.naming.records import Hypothesis
from airtouch.gap.result import Closure, Quantity
from airtouch.gap.signals.spectra import OVERLAP_WEIGHT, squared
from airtouch.gap.signatures.signature import CLOCK
from airtouch.gap.signatures.term import Term

#: standard errors, beside MARGIN, by which a cell's mean power ratio must exceed 1; chosen against cells that stand
#: out by chance. A larger number overlooks weak gaps. The error is that of exponential values of mean 1, of which the
#: fraction OVERLAP_WEIGHT is independent
STANDARD_ERRORS = 4.0
#: by which a cell's mean power ratio must exceed 1 however many values it has; chosen. A larger number overlooks weak
#: gaps, a smaller one takes small errors of the floor for gaps
MARGIN = 0.2
FEWEST_VALUES = 12  #: values that a cell needs; chosen. A larger number leaves out the lowest bands of short flights
#: bootstrap samples of the fraction closed; chosen, the ends of its interval then vary little. A larger number takes
#: more time
DRAWS = 400
#: equal parts of the held-out values, at most, which the bootstrap draws; chosen. With a larger number the parts are
#: shorter, and neighbours that vary together make the interval too narrow
PIECES = 24
SEED = 0  #: of the bootstrap
INTERVAL = (5.0, 95.0)  #: percentiles of the bootstrap between which the 90 % interval lies
#: largest power ratio of a value, so that no spike makes a gap; chosen. A larger number lets one do
LARGEST_RATIO = 1e4
#: gap above the floor, in units of it, up to which the fraction closed is said to be 0; chosen. A larger number gives
#: none for small gaps, a smaller one a ratio of two noises
LEAST_EXCESS = 0.02
#: parts of a flight, of which every other one is a half of the data; chosen. With a smaller number a slow change of the
#: jitter counts as what the halves differ by
JITTER_PIECES = 8


@dataclass(frozen=True)
class Gap:
    """A gap on held-out data, and how far the effects named close it.

    cells: in which it is measured, bool (CELLS,) for each half, as the other half shows them; deficit: by how much the
    mean power ratio there is below 1 once the effects named are in the model, 0 at least; ratios_before (n,): power
    ratios without any effect, the deficit added; closure: by the effects named.
    """

    cells: tuple[np.ndarray, np.ndarray]
    deficit: float
    ratios_before: np.ndarray
    closure: Closure


def gap_of(data: Data, halves: Sequence[BlockSet], hypothesis: Hypothesis | None) -> Gap:
    """The gap of two halves of the data, each in the cells that the other shows. hypothesis: the effects named."""
    terms = _terms_of_halves(hypothesis)
    cells = _cells_with_gap(data, halves[1], terms[1]), _cells_with_gap(data, halves[0], terms[0])
    after = _ratios(data, halves, terms, cells)
    deficit = max(1.0 - after.mean(), 0.0) if len(after) else 0.0
    before = deficit + _ratios(data, halves, _terms_of_halves(None), cells)
    closure = closure_of_jitter(data) if is_only_jitter(hypothesis) else _closure(before, deficit + after)
    return Gap(cells, deficit, before, closure)


def closure_of(data: Data, halves: Sequence[BlockSet], hypothesis: Hypothesis | None, gap: Gap) -> Closure:
    """How far another hypothesis than the effects named closes the gap of two halves; None closes nothing."""
    if is_only_jitter(hypothesis):
        return closure_of_jitter(data)
    return _closure(gap.ratios_before, gap.deficit + _ratios(data, halves, _terms_of_halves(hypothesis), gap.cells))


def is_only_jitter(hypothesis: Hypothesis | None) -> bool:
    """Whether a hypothesis moves the logged times and does nothing else."""
    return hypothesis is not None and bool(hypothesis.terms) \
        and all(t.shows_in == CLOCK and not t.signature.loses_rows for t in hypothesis.terms)


def _closure(before: np.ndarray, after: np.ndarray) -> Closure:
    """The closure by held-out power ratios (n,) without and with effects; without any value the gap is at its floor."""
    if not len(before):
        return Closure(1.0, 1.0, Quantity(0.0, 0.0, 0.0))
    return Closure(float(np.sqrt(before.mean())), float(np.sqrt(after.mean())),
                  Quantity(fraction_closed(before.mean(), after.mean()), *_interval(before, after)))


def closure_of_jitter(data: Data) -> Closure:
    """The closure where only the logged times are irregular: how well the jitter of one half predicts the other's.

    The gap is the rms of the logged times around regular ones, their mean not removed, over that of nominal flights.
    After an effect is in the model, what is left is the floor and what the halves differ by. Two numbers give no
    interval.
    """
    floor = nominal_time_rms_s(data.study)
    rms = [float(np.sqrt(np.mean(np.concatenate([piece for f in data.flights for piece in
                                                 np.array_split(f.clock_s, JITTER_PIECES)[half::2]]) ** 2)))
           for half in (0, 1)]
    before = float(np.mean(rms)) / floor
    after = 1.0 + abs(rms[0] - rms[1]) / floor
    return Closure(before, after, Quantity(fraction_closed(before ** 2, after ** 2)))


def fraction_closed(before: float, after: float) -> float:
    """Fraction of the gap above the floor that is closed, (rms before - rms after) / (rms before - 1), within -1 and 1.

    before, after: mean power ratios, the squares of these rms values; the floor is 1. The fraction is 0 where the gap
    is no more than LEAST_EXCESS above the floor.
    """
    over = np.sqrt(before) - 1.0
    return float(np.clip((np.sqrt(before) - np.sqrt(after)) / over, -1.0, 1.0)) if over > LEAST_EXCESS else 0.0


def _interval(before: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    """Ends of the 90 % interval of `fraction_closed`, by block bootstrap of held-out power ratios (n,)."""
    pieces = min(PIECES, len(before))
    means_before, means_after = (np.array([p.mean() for p in np.array_split(x, pieces)]) for x in (before, after))
    drawn = np.random.default_rng(SEED).integers(0, pieces, (DRAWS, pieces))
    fractions = [fraction_closed(b, a) for b, a in zip(means_before[drawn].mean(axis=1),
                                                       means_after[drawn].mean(axis=1), strict=True)]
    low, high = np.percentile(fractions, INTERVAL)
    return float(low), float(high)


def is_nearer_to_floor(data: Data, halves: Sequence[BlockSet], hypothesis: Hypothesis | None, gap: Gap) -> bool:
    """Whether the cells of a gap lie nearer to the floor with a hypothesis than without, on held-out blocks.

    Another loop makes more of the noise at some frequencies and less at others, so that no gap stands over the floor.
    """
    before, after = (_distance_from_floor(data, halves, _terms_of_halves(effects), gap.cells)
                     for effects in (None, hypothesis))
    return after < before


def _distance_from_floor(data: Data, halves: Sequence[BlockSet], terms: Sequence[Sequence[Term]],
               cells: Sequence[np.ndarray]) -> float:
    """Distance of the cells' mean power ratio from 1, above or below, times their values, summed over the cells."""
    total, count = np.zeros(CELLS), np.zeros(CELLS)
    for cell, ratios in _held_out_ratios(data, halves, terms, cells):
        total += np.bincount(cell, ratios, CELLS)
        count += np.bincount(cell, minlength=CELLS)
    return float(np.abs(total - count).sum())


def _terms_of_halves(hypothesis: Hypothesis | None) -> Sequence[Sequence[Term]]:
    """The terms of a hypothesis as fitted to each half; none where there is no hypothesis."""
    return [f.terms for f in hypothesis.fits] if hypothesis and hypothesis.fits else ((), ())


def _ratios(data: Data, halves: Sequence[BlockSet], terms: Sequence[Sequence[Term]], cells: Sequence[np.ndarray],
              ) -> np.ndarray:
    """Power ratios (n,) of both halves: see `_held_out_ratios`."""
    return np.concatenate([ratios for _, ratios in _held_out_ratios(data, halves, terms, cells)])


def _held_out_ratios(data: Data, halves: Sequence[BlockSet], terms: Sequence[Sequence[Term]],
                     cells: Sequence[np.ndarray]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """For each half, cell number (n,) and power ratio (n,) of its values in the cells.

    The power is that of what effects as fitted to the other half leave. cells: mask (CELLS,) for each half.
    """
    for half in (0, 1):
        judged = judged_blocks(data, halves[half], terms[1 - half])
        cell = judged.problem.flat.cells
        use = judged.problem.elements.valid & cells[half][cell]
        yield cell[use], _power_ratio(judged)[use]


def _cells_with_gap(data: Data, half: BlockSet, terms: Sequence[Term]) -> np.ndarray:
    """Mask (CELLS,) of the cells that show a gap in a half of the data, or in which effects fitted to it gain."""
    judged = judged_blocks(data, half, ())
    cell, valid = judged.problem.flat.cells, judged.problem.elements.valid
    count = np.bincount(cell, valid, CELLS)
    mean = np.bincount(cell, _power_ratio(judged) * valid, CELLS) / np.maximum(count, 1)
    error = np.sqrt(1.0 / (OVERLAP_WEIGHT * np.maximum(count, 1)))
    out = mean > 1.0 + STANDARD_ERRORS * error + MARGIN
    if terms:
        out |= cell_gains(data, half, terms) > CELL_GAIN
    return out & (count >= FEWEST_VALUES)


def _power_ratio(judged: JudgedBlocks) -> np.ndarray:
    """Power ratio (n,) of each value, LARGEST_RATIO at most."""
    return np.minimum(squared(judged.residual) / judged.expected_power, LARGEST_RATIO)
