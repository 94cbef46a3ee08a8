"""How far: the gap before and after an effect is in the model, on data that it was not fitted on.

Gap is the rms of the whitened spectra (floor 1) over the cells, view by channel by band,
in which the other half of the data shows one. A cell's own floor is 1 by definition.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.data import Data
from airtouch.gap.fit import left_over
from airtouch.gap.problem import Part
from airtouch.gap.result import Quantity
from airtouch.gap.selection import Judged

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


def shrink_of(data: Data, parts: Sequence[Part], judged: Judged | None, seed: int = 0) -> Shrink:
    """The gap over all held-out blocks; each half judged under the fit of the other."""
    if judged is not None and judged.terms and all(t.name == "time_jitter" for t in judged.terms):
        return _clock(data)
    before, after = [], []
    for train, test in ((0, 1), (1, 0)):
        problem, values, power = left_over(data, parts[train], ())
        groups = problem.groups
        e = np.minimum(np.abs(values) ** 2 / power, LARGEST)
        count = np.bincount(groups, problem.known)
        mean = np.bincount(groups, e * problem.known) / np.maximum(count, 1)
        large = (count >= FEWEST) & (mean > 1.0 + SURE * np.sqrt(2.0 / np.maximum(count, 1)) + 0.2)
        problem, values, power = left_over(data, parts[test], ())
        groups = np.minimum(problem.groups, len(large) - 1)
        use = problem.known & large[groups]
        first = np.minimum(np.abs(values) ** 2 / power, LARGEST)[use]
        terms = judged.fits[train].terms if judged and judged.fits else ()
        problem, values, power = left_over(data, parts[test], terms)
        before.append(first)
        after.append(np.minimum(np.abs(values) ** 2 / power, LARGEST)[use])
    one, two = np.concatenate(before), np.concatenate(after)
    if not len(one):
        return Shrink(1.0, 1.0, Quantity(0.0, 0.0, 0.0))
    rng = np.random.default_rng(seed)
    pieces = min(24, len(one))
    a = np.array([p.mean() for p in np.array_split(one, pieces)])
    b = np.array([p.mean() for p in np.array_split(two, pieces)])
    pick = rng.integers(0, pieces, (DRAWS, pieces))
    drawn = [_share(x, y) for x, y in zip(a[pick].mean(axis=1), b[pick].mean(axis=1), strict=True)]
    low, high = np.percentile(drawn, [5, 95])
    return Shrink(float(np.sqrt(one.mean())), float(np.sqrt(two.mean())),
                  Quantity(_share(one.mean(), two.mean()), float(low), float(high)))


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
