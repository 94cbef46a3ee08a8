"""How far: the gap before and after an effect is in the model, on data that it was not fitted on.

Gap is the rms of the whitened spectra (floor 1) over the cells, view by channel by band,
in which the other half of the data shows one, or in which the effects named gain there.
A cell's own floor is 1 by definition: where less is left, the flights were calmer than nominal
ones by so much, and that is taken off the floor, not off the gap.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.candidates import SPECTRUM, Term
from airtouch.gap.data import Data
from airtouch.gap.fit import left_over
from airtouch.gap.problem import GROUPS, Part
from airtouch.gap.result import Quantity
from airtouch.gap.selection import Judged

SURE = 4.0  #: standard errors by which a cell must stand over the floor
FEWEST = 12  #: values in a cell
TELLING = 1.0  #: log likelihood that effects gain in a cell which they move
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
    """Where a gap is measured, bool (GROUPS,) for each half as the other shows it, and by how much e (floor 1) is

    calmer there than in nominal flights once the effects named are in the model.
    """

    chosen: tuple[np.ndarray, np.ndarray]
    calm: float


def cells_of(data: Data, parts: Sequence[Part], named: Judged | None) -> Cells:
    """The cells of some flights. named: the effects named."""
    terms = [f.terms for f in named.fits] if named and named.fits else [(), ()]
    chosen = tuple(_standing_out(data, parts[1 - k], terms[1 - k]) for k in (0, 1))
    left = np.concatenate([_energy(data, parts[k], terms[1 - k], chosen[k]) for k in (0, 1)])
    return Cells(chosen, max(1.0 - left.mean(), 0.0) if len(left) else 0.0)


def shrink_of(data: Data, parts: Sequence[Part], judged: Judged | None, cells: Cells, seed: int = 0) -> Shrink:
    """The gap over all held-out blocks; each half judged under the fit of the other."""
    if judged is not None and judged.terms and all(t.name == "time_jitter" for t in judged.terms):
        return _clock(data)
    terms = [f.terms for f in judged.fits] if judged and judged.fits else [(), ()]
    one, two = (cells.calm + np.concatenate([_energy(data, parts[k], some[1 - k], cells.chosen[k]) for k in (0, 1)])
                for some in (((), ()), terms))
    if not len(one):
        return Shrink(1.0, 1.0, Quantity(0.0, 0.0, 0.0))
    rng = np.random.default_rng(seed)
    pieces = min(24, len(one))
    a, b = (np.array([p.mean() for p in np.array_split(x, pieces)]) for x in (one, two))
    pick = rng.integers(0, pieces, (DRAWS, pieces))
    drawn = [_share(x, y) for x, y in zip(a[pick].mean(axis=1), b[pick].mean(axis=1), strict=True)]
    low, high = np.percentile(drawn, [5, 95])
    return Shrink(float(np.sqrt(one.mean())), float(np.sqrt(two.mean())),
                  Quantity(_share(one.mean(), two.mean()), float(low), float(high)))


def _energy(data: Data, part: Part, terms: Sequence[Term], cells: np.ndarray) -> np.ndarray:
    """Energy (n,) over the floor that effects leave of the values of a part that lie in cells."""
    problem, values, power = left_over(data, part, terms)
    use = problem.known & cells[problem.groups]
    return np.minimum(np.abs(values[use]) ** 2 / power[use], LARGEST)


def _standing_out(data: Data, part: Part, terms: Sequence[Term]) -> np.ndarray:
    """Which cells, bool (GROUPS,), show a gap in a part, or are where effects fitted to it gain."""
    problem, values, power = left_over(data, part, ())
    e = np.minimum(np.abs(values) ** 2 / power, LARGEST)
    count = np.bincount(problem.groups, problem.known, GROUPS)
    mean = np.bincount(problem.groups, e * problem.known, GROUPS) / np.maximum(count, 1)
    out = mean > 1.0 + SURE * np.sqrt(2.0 / np.maximum(count, 1)) + 0.2
    if terms:
        wide = any(t.kind == SPECTRUM for t in terms)
        level = [problem.each(values, power - problem.power) for _, values, power in
                 (left_over(data, part, some, wide) for some in (terms, ()))]
        out |= np.bincount(problem.groups, level[0] - level[1], GROUPS) > TELLING
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
