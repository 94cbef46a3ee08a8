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
from airtouch.twin.recorded.flights import RecordedFlights
from airtouch.vehicle import Vehicle

REPEATS = 2  #: simulated flights of each recorded course; no source: the least with a scatter
FIRST_NUMBER = 1_000_000  #: number of the first flight; larger than that of any flight of the fit


@dataclass(frozen=True)
class SimulatedFlight:
    """A simulated flight: its course, the number of the recorded course, channels (n, 12) and features (features,)."""

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
    """A comparison of simulated with recorded flights.

    misfit: group -> rms of mean differences, in scatters. gaps: from the largest. auroc: by phase. diverged: number of
    simulated flights without features.
    """

    misfit: dict[str, float]
    gaps: list[Gap]
    auroc: list[Auroc]
    diverged: int
    flights: list[SimulatedFlight]


def fly_courses(courses: Sequence[Course], vehicle: Vehicle, levers: Sequence[Lever], values: np.ndarray, seed: int,
                fixed: Mapping[str, Any] | None = None, repeats: int = REPEATS,
                progress: Callable[[int, int], None] = lambda *_: None) -> tuple[list[SimulatedFlight], int]:
    """Simulated flights of each course, `repeats` times with the levers' values, and the number without features.

    values: (levers,). fixed: effects without levers. progress: as progress(done, total). A flight that diverges, or
    whose log shows no course, has no features.
    """
    out, diverged, total = [], 0, repeats * len(courses)
    for k in range(total):
        course = courses[k % len(courses)]
        log = fly.fly(course, vehicle, levers, values, seed, FIRST_NUMBER + k, fixed)
        try:
            if isinstance(log, Diverged):
                raise AirTouchError(str(log))
            simulated = fly.simulated_course(log, course)
            out.append(SimulatedFlight(simulated, k % len(courses), channels(log), features(log, simulated)))
        except AirTouchError:
            diverged += 1
        progress(k + 1, total)
    return out, diverged


def compare(recorded: RecordedFlights, target: fit.Target, simulated: Sequence[SimulatedFlight], diverged: int,
            seed: int = 0, progress: Callable[[str], None] = lambda _: None) -> Comparison:
    """The comparison that the report shows. Features are compared course by course.

    diverged: number of further simulated flights. progress: as progress(phase). Raises AirTouchError without
    scikit-learn.
    """
    difference = np.array([f.features - recorded.features[f.number] for f in simulated])
    with np.errstate(invalid="ignore"):
        standard = np.clip(difference / target.scatter, -fit.CLIP, fit.CLIP)
    mean = _nanmean(standard)
    gaps = []
    for k in np.argsort(-np.abs(np.nan_to_num(mean))):
        if np.isfinite(mean[k]):
            flights = len({f.number for f, row in zip(simulated, difference, strict=True) if np.isfinite(row[k])})
            gaps.append(Gap(names()[k], float(np.nanmean(difference[:, k])), float(mean[k]), flights))
    real = windows([(x, c, i) for i, (x, c) in enumerate(zip(recorded.channels, recorded.courses, strict=True))])
    model = windows([(f.channels, f.course, f.number) for f in simulated])
    return Comparison(fit.misfit(mean), gaps, two_sample(real, model, seed, progress), diverged, list(simulated))


def _nanmean(values: np.ndarray) -> np.ndarray:
    """Mean over the rows, NaN without a warning where all are."""
    count = np.isfinite(values).sum(axis=0)
    return np.where(count > 0, np.nansum(values, axis=0) / np.maximum(count, 1), np.nan)
