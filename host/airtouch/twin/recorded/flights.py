"""Recorded flights read, checked and turned into courses and features."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from airtouch import logs
from airtouch.detector.evaluation.data import dataset
from airtouch.errors import AirTouchError
from airtouch.twin.recorded import course as courses
from airtouch.twin.recorded import near_range
from airtouch.twin.recorded.channels import channels
from airtouch.twin.recorded.course import Course
from airtouch.twin.recorded.features import features
from airtouch.twin.recorded.near_range import NearRange

FEWEST = 4  #: least number of flights to fit a twin to


@dataclass(frozen=True)
class Recorded:
    """Flights to fit a twin to: courses, channels (each (n, 12)), features (flights, features).

    near: error of their down range near the platform, None if unknown.
    """

    vehicle: str
    courses: list[Course]
    channels: list[np.ndarray]
    features: np.ndarray
    left_out: list[tuple[str, str]]
    near: NearRange | None = None


def recorded(paths: Sequence[str | Path], *, speed_mps: float | None = None, folds: Sequence[int] = (),
             progress: Callable[[int, int], None] = lambda *_: None) -> Recorded:
    """Read the flights of files and folders. Speeds and angles come from a manifest beside them, or from the logs.

    folds: only flights of these folds of the manifest. Flights that cannot be used are in `left_out` with
    the reason. Raises AirTouchError, with what to fly, if fewer than FEWEST can be used, and for two vehicles.
    """
    files = [f for f in dataset.collect(paths, speed_mps) if not folds or f.condition.fold in folds]
    if not files:
        raise AirTouchError(f"no flight is in fold {', '.join(map(str, folds))} of the manifest")
    usable, numbers, shapes, left_out, named = [], [], [], [], []
    for i, file in enumerate(files):
        try:
            log = logs.read(file.path)
            chosen = courses.course(log, file.condition.speed_mps, file.condition.angle_deg)
            numbers.append(features(log, chosen))
            shapes.append(channels(log))
            usable.append(chosen)
            named.append(log.slice(0, 1))
        except AirTouchError as error:
            left_out.append((str(file.path), str(error)))
        progress(i + 1, len(files))
    if not usable:
        raise AirTouchError(left_out[0][1])
    if len(usable) < FEWEST:
        why = f"; {left_out[0][1]}" if left_out else ""
        raise AirTouchError(f"{len(usable)} of {len(files)} flights can be used and {FEWEST} are needed: fly straight "
                            f"over the platform's two edges {FEWEST - len(usable)} more times, at two heights{why}")
    near = near_range.measure(usable, shapes)
    if near is not None:
        usable = [replace(c, top_m=near.top_m) for c in usable]
    return Recorded(courses.one_vehicle(named), usable, shapes, np.array(numbers), left_out, near)
