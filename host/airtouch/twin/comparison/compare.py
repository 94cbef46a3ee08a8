"""Comparison of a fitted twin with the recorded flights: remaining differences, and AUROC of a classifier."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.simulation.flight import Diverged
from airtouch.twin.comparison.two_sample import Auroc, two_sample, windows
from airtouch.twin.fitting import fit, fly
from airtouch.twin.fitting.levers import Lever
from airtouch.twin.recorded.channels import channels
from airtouch.twin.recorded.course import Course
from airtouch.twin.recorded.features import Feature, features, names
from airtouch.twin.recorded.flights import Recorded
from airtouch.vehicle import Vehicle

REPEATS = 2  #: simulated flights of each recorded course
FIRST = 1_000_000  #: number of the first flight; larger than that of any flight of the fit


@dataclass(frozen=True)
class Flown:
    """A simulated flight: its course, the number of that course, channels (n, 12) and features (features,)."""

    course: Course
    number: int
    channels: np.ndarray
    features: np.ndarray


@dataclass(frozen=True)
class Gap:
    """Difference of a feature: mean of simulated less recorded, in its unit and in scatters; number of flights."""

    feature: Feature
    difference: float
    scatters: float
    flights: int


@dataclass(frozen=True)
class Comparison:
    """A comparison: misfit by group (rms of mean differences in scatters), gaps from the largest, AUROC by phase."""

    misfit: dict[str, float]
    gaps: list[Gap]
    auroc: list[Auroc]
    lost: int
    flown: list[Flown]


def flown(chosen: Sequence[Course], vehicle: Vehicle, levers: Sequence[Lever], values: np.ndarray, seed: int,
          fixed: Mapping[str, Any] | None = None, repeats: int = REPEATS,
          progress: Callable[[int, int], None] = lambda *_: None) -> tuple[list[Flown], int]:
    """Simulated flights of each course, `repeats` times with the levers' values, and the number that diverged."""
    out, lost, total = [], 0, repeats * len(chosen)
    for k in range(total):
        course = chosen[k % len(chosen)]
        log = fly.fly(course, vehicle, levers, values, seed, FIRST + k, fixed)
        try:
            if isinstance(log, Diverged):
                raise AirTouchError(str(log))
            real = fly.simulated_course(log, course)
            out.append(Flown(real, k % len(chosen), channels(log), features(log, real)))
        except AirTouchError:
            lost += 1
        progress(k + 1, total)
    return out, lost


def compare(recorded: Recorded, aim: fit.Target, simulated: Sequence[Flown], lost: int, seed: int = 0,
            progress: Callable[[str], None] = lambda _: None) -> Comparison:
    """The comparison that the report shows. Features are compared course by course."""
    difference = np.array([f.features - recorded.features[f.number] for f in simulated])
    with np.errstate(invalid="ignore"):
        standard = np.clip(difference / aim.scatter, -fit.CLIP, fit.CLIP)
    mean = _nanmean(standard)
    gaps = []
    for k in np.argsort(-np.abs(np.nan_to_num(mean))):
        if np.isfinite(mean[k]):
            flights = len({f.number for f, row in zip(simulated, difference, strict=True) if np.isfinite(row[k])})
            gaps.append(Gap(names()[k], float(np.nanmean(difference[:, k])), float(mean[k]), flights))
    real = windows([(x, c, i) for i, (x, c) in enumerate(zip(recorded.channels, recorded.courses, strict=True))])
    fake = windows([(f.channels, f.course, f.number) for f in simulated])
    return Comparison(fit.misfit(mean), gaps, two_sample(real, fake, seed, progress), lost, list(simulated))


def _nanmean(values: np.ndarray) -> np.ndarray:
    """Mean over the rows, NaN without a warning where all are."""
    count = np.isfinite(values).sum(axis=0)
    return np.where(count > 0, np.nansum(values, axis=0) / np.maximum(count, 1), np.nan)
