"""How far: the gap before and after an effect is in the model, on data that it was not fitted on.

Gap is the rms of the whitened spectra (floor 1) over the cells, view by channel by band,
in which the other half of the data shows one, or in which the effects named gain there.
A cell's own floor is 1 by definition: where less is left, the flights were calmer than nominal
ones by so much, and that is taken off the floor, not off the gap.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.evidence.cells import GROUPS
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import CELL_GAIN, cell_gains, left_over
from airtouch.gap.evidence.problem import Part
from airtouch.gap.naming.selection import Judged
from airtouch.gap.result import Quantity
from airtouch.gap.signals.spectra import squared
from airtouch.gap.signatures.term import Term

SURE = 4.0  #: standard errors, beside MARGIN, by which a cell's mean energy must exceed the floor; chosen
MARGIN = 0.2  #: energy, in units of the floor, by which a cell must exceed it however many values it has; chosen
FEWEST = 12  #: values that a cell needs
DRAWS = 400  #: bootstrap samples of the shrink
PIECES = 24  #: equal parts of the held-out values, at most, which the bootstrap draws
INTERVAL = (5.0, 95.0)  #: percentiles of the bootstrap between which the 90 % interval lies
LARGEST = 1e4  #: energy of a bin over the floor, at most: spikes do not make a gap
LEAST_GAP = 0.02  #: gap over the floor, in units of it, up to which no share of it can be given
LEAST_JITTER_S = 2e-4  #: seconds rms that the floor of the logged times' jitter has at least
CLOCK_PIECES = 8  #: parts of a flight, of which every other one is a half of the data


@dataclass(frozen=True)
class Shrink:
    """Gap before and after in units of the floor, and the share of it that went, with 90 % interval."""

    before: float
    after: float
    share: Quantity


@dataclass(frozen=True)
class Cells:
    """Where a gap is measured: bool (GROUPS,) for each half, as the other half shows it.

    calm: by how much the energy there (floor 1) is below nominal flights' once the effects named are in the model.
    before: energies (n,) without any effect, calm added.
    """

    chosen: tuple[np.ndarray, np.ndarray]
    calm: float
    before: np.ndarray


def cells_of(data: Data, parts: Sequence[Part], named: Judged | None) -> Cells:
    """The cells in which the gap of two halves of the data is measured. named: the effects named."""
    terms = _terms(named)
    chosen = _standing_out(data, parts[1], terms[1]), _standing_out(data, parts[0], terms[0])
    after = _energies(data, parts, terms, chosen)
    calm = max(1.0 - after.mean(), 0.0) if len(after) else 0.0
    return Cells(chosen, calm, calm + _energies(data, parts, ((), ()), chosen))


def shrink_of(data: Data, parts: Sequence[Part], judged: Judged | None, cells: Cells, seed: int = 0) -> Shrink:
    """The gap over all held-out blocks, each half judged under the fit of the other. seed: of the bootstrap."""
    if judged is not None and judged.terms and all(t.name == "time_jitter" for t in judged.terms):
        return _clock(data)
    before = cells.before
    if not len(before):
        return Shrink(1.0, 1.0, Quantity(0.0, 0.0, 0.0))
    after = cells.calm + _energies(data, parts, _terms(judged), cells.chosen)
    rng = np.random.default_rng(seed)
    pieces = min(PIECES, len(before))
    a, b = (np.array([p.mean() for p in np.array_split(x, pieces)]) for x in (before, after))
    pick = rng.integers(0, pieces, (DRAWS, pieces))
    shares = [_share(x, y) for x, y in zip(a[pick].mean(axis=1), b[pick].mean(axis=1), strict=True)]
    low, high = np.percentile(shares, INTERVAL)
    return Shrink(float(np.sqrt(before.mean())), float(np.sqrt(after.mean())),
                  Quantity(_share(before.mean(), after.mean()), float(low), float(high)))


def nearer(data: Data, parts: Sequence[Part], judged: Judged | None, cells: Cells) -> bool:
    """Whether the cells lie nearer to the floor with a hypothesis than without, on held-out blocks.

    Another loop makes more of the noise at some frequencies and less at others, so that no gap stands over the floor.
    """
    without, within = (_off_floor(data, parts, terms, cells) for terms in (((), ()), _terms(judged)))
    return within < without


def _off_floor(data: Data, parts: Sequence[Part], terms: Sequence[Sequence[Term]], cells: Cells) -> float:
    """Distance of the chosen cells' energy from the floor, above or below, summed over their values."""
    total, count = np.zeros(GROUPS), np.zeros(GROUPS)
    for k in (0, 1):
        problem, values, power = left_over(data, parts[k], terms[1 - k])
        use = problem.known & cells.chosen[k][problem.groups]
        total += np.bincount(problem.groups[use], np.minimum(squared(values[use]) / power[use], LARGEST), GROUPS)
        count += np.bincount(problem.groups[use], minlength=GROUPS)
    return float(np.abs(total - count).sum())


def _terms(judged: Judged | None) -> Sequence[Sequence[Term]]:
    """The terms of a hypothesis as fitted to each half; none where there is no hypothesis."""
    return [f.terms for f in judged.fits] if judged and judged.fits else ((), ())


def _energies(data: Data, parts: Sequence[Part], terms: Sequence[Sequence[Term]], chosen: Sequence[np.ndarray],
              ) -> np.ndarray:
    """Energy (n,) over the floor that effects fitted to each half leave of the other's values in chosen cells."""
    out = []
    for k in (0, 1):
        problem, values, power = left_over(data, parts[k], terms[1 - k])
        use = problem.known & chosen[k][problem.groups]
        out.append(np.minimum(squared(values[use]) / power[use], LARGEST))
    return np.concatenate(out)


def _standing_out(data: Data, part: Part, terms: Sequence[Term]) -> np.ndarray:
    """Mask (GROUPS,) of the cells that show a gap in a part, or in which effects fitted to it gain."""
    problem, values, power = left_over(data, part, ())
    energy = np.minimum(squared(values) / power, LARGEST)
    count = np.bincount(problem.groups, problem.known, GROUPS)
    mean = np.bincount(problem.groups, energy * problem.known, GROUPS) / np.maximum(count, 1)
    out = mean > 1.0 + SURE * np.sqrt(2.0 / np.maximum(count, 1)) + MARGIN
    if terms:
        out |= cell_gains(data, part, terms) > CELL_GAIN
    return out & (count >= FEWEST)


def _clock(data: Data) -> Shrink:
    """The shrink of jitter in the logged times: how well the rms of one half predicts the other's, over the floor."""
    floor = max(data.study.floor.clock_s, LEAST_JITTER_S)
    rms = [float(np.sqrt(np.mean(np.concatenate([h for f in data.flights
                                                  for h in np.array_split(f.clock_s, CLOCK_PIECES)[k::2]]) ** 2)))
           for k in (0, 1)]
    before = float(np.mean(rms)) / floor
    after = 1.0 + abs(rms[0] - rms[1]) / floor
    share = _share(before ** 2, after ** 2)
    return Shrink(before, after, Quantity(share, share, share))


def _share(before: float, after: float) -> float:
    """The share of the gap that went, (before - after) / (before - floor) of rms values with a floor of 1."""
    over = np.sqrt(before) - 1.0
    return float(np.clip((np.sqrt(before) - np.sqrt(after)) / over, -1.0, 1.0)) if over > LEAST_GAP else 0.0
