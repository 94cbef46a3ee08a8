"""How far: the gap before and after an effect is in the model, on data that it was not fitted on.

Gap is the rms of the whitened spectra (floor 1) over the cells, view by channel by band,
in which the other half of the data shows one, or in which the effects named gain there.
A cell's own floor is 1 by definition: where less is left, the flights were calmer than nominal
ones by so much, and that is taken off the floor, not off the gap.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import CELL_GAIN, cell_gains, left_over
from airtouch.gap.evidence.problem import GROUPS, Part
from airtouch.gap.naming.selection import Judged
from airtouch.gap.result import Quantity
from airtouch.gap.signals.spectra import squared
from airtouch.gap.signatures.candidates import Term

SURE = 4.0  #: standard errors by which a cell must stand over the floor
FEWEST = 12  #: values in a cell
DRAWS = 400
LARGEST = 1e4  #: of a bin's power over the floor: spikes do not make a gap


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
    """The cells of some flights. named: the effects named."""
    terms = _terms(named)
    chosen = _standing_out(data, parts[1], terms[1]), _standing_out(data, parts[0], terms[0])
    after = _energies(data, parts, terms, chosen)
    calm = max(1.0 - after.mean(), 0.0) if len(after) else 0.0
    return Cells(chosen, calm, calm + _energies(data, parts, ((), ()), chosen))


def shrink_of(data: Data, parts: Sequence[Part], judged: Judged | None, cells: Cells, seed: int = 0) -> Shrink:
    """The gap over all held-out blocks; each half judged under the fit of the other."""
    if judged is not None and judged.terms and all(t.name == "time_jitter" for t in judged.terms):
        return _clock(data)
    before = cells.before
    if not len(before):
        return Shrink(1.0, 1.0, Quantity(0.0, 0.0, 0.0))
    after = cells.calm + _energies(data, parts, _terms(judged), cells.chosen)
    rng = np.random.default_rng(seed)
    pieces = min(24, len(before))
    a, b = (np.array([p.mean() for p in np.array_split(x, pieces)]) for x in (before, after))
    pick = rng.integers(0, pieces, (DRAWS, pieces))
    drawn = [_share(x, y) for x, y in zip(a[pick].mean(axis=1), b[pick].mean(axis=1), strict=True)]
    low, high = np.percentile(drawn, [5, 95])
    return Shrink(float(np.sqrt(before.mean())), float(np.sqrt(after.mean())),
                  Quantity(_share(before.mean(), after.mean()), float(low), float(high)))


def nearer(data: Data, parts: Sequence[Part], judged: Judged | None, cells: Cells) -> bool:
    """Whether the cells lie nearer to the floor with a hypothesis than without, on held-out blocks.

    Another loop makes more of the noise at some frequencies and less at others, so that no gap stands over the floor.
    """
    without, with_it = (_off_floor(data, parts, terms, cells) for terms in (((), ()), _terms(judged)))
    return with_it < without


def _off_floor(data: Data, parts: Sequence[Part], terms: Sequence[Sequence[Term]], cells: Cells) -> float:
    """Mean distance of a chosen cell's energy from the floor, above or below, over its values."""
    total, many = np.zeros(GROUPS), np.zeros(GROUPS)
    for k in (0, 1):
        problem, values, power = left_over(data, parts[k], terms[1 - k])
        use = problem.known & cells.chosen[k][problem.groups]
        total += np.bincount(problem.groups[use], np.minimum(squared(values[use]) / power[use], LARGEST), GROUPS)
        many += np.bincount(problem.groups[use], minlength=GROUPS)
    return float(np.abs(total - many).sum())


def _terms(judged: Judged | None) -> Sequence[Sequence[Term]]:
    """A hypothesis as fitted to each half; nothing where there is none."""
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
    """Which cells, bool (GROUPS,), show a gap in a part, or are where effects fitted to it gain."""
    problem, values, power = left_over(data, part, ())
    e = np.minimum(squared(values) / power, LARGEST)
    count = np.bincount(problem.groups, problem.known, GROUPS)
    mean = np.bincount(problem.groups, e * problem.known, GROUPS) / np.maximum(count, 1)
    out = mean > 1.0 + SURE * np.sqrt(2.0 / np.maximum(count, 1)) + 0.2
    if terms:
        out |= cell_gains(data, part, terms) > CELL_GAIN
    return out & (count >= FEWEST)


def _clock(data: Data) -> Shrink:
    """Jitter of the logged times: what the rms of one half says of the other's, over the floor's."""
    usual = max(data.study.floor.clock_s, 2e-4)
    rms = [float(np.sqrt(np.mean(np.concatenate([h for f in data.flights
                                                  for h in np.array_split(f.clock_s, 8)[k::2]]) ** 2)))
           for k in (0, 1)]
    before = float(np.mean(rms)) / usual
    after = 1.0 + abs(rms[0] - rms[1]) / usual
    share = _share(before ** 2, after ** 2)
    return Shrink(before, after, Quantity(share, share, share))


def _share(before: float, after: float) -> float:
    """(before - after) / (before - floor) of rms values with a floor of 1."""
    top = np.sqrt(before) - 1.0
    return float(np.clip((np.sqrt(before) - np.sqrt(after)) / top, -1.0, 1.0)) if top > 0.02 else 0.0
