"""Recorded flights read, checked and turned into courses and features."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from airtouch import logs
from airtouch.detector.evaluation.data import dataset
from airtouch.detector.evaluation.data.folds import in_folds
from airtouch.errors import AirTouchError
from airtouch.twin.recorded import course as courses
from airtouch.twin.recorded import near_range
from airtouch.twin.recorded.channels import channels
from airtouch.twin.recorded.course import Course
from airtouch.twin.recorded.features import features
from airtouch.twin.recorded.near_range import NearRange

MIN_FLIGHTS = 4  #: least number of flights to fit a twin to; no source: two heights, twice


@dataclass(frozen=True)
class RecordedFlights:
    """Flights to fit a twin to: courses, channels (each (n, 12)), features (flights, features).

    vehicle: that the logs name, "" if none does. left_out: (path, reason) of flights that cannot be used. near: error
    of their down range near the platform, None if unknown.
    """

    vehicle: str
    courses: list[Course]
    channels: list[np.ndarray]
    features: np.ndarray
    left_out: list[tuple[str, str]]
    near: NearRange | None = None


def read(paths: Sequence[str | Path], *, speed_mps: float | None = None, folds: Sequence[int] = (),
         progress: Callable[[int, int], None] = lambda *_: None) -> RecordedFlights:
    """Read the flights of files and folders. Speeds and angles come from a manifest beside them, or from the logs.

    speed_mps: of flights whose manifest states none. folds: only flights of these folds of the manifest. progress: as
    progress(done, total). Flights that cannot be used are in `left_out` with the reason. Raises AirTouchError, with
    what to fly, if fewer than MIN_FLIGHTS can be used, and for two vehicles.
    """
    files = in_folds(dataset.collect(paths, speed_mps), folds)
    usable, feature_rows, channel_arrays, left_out, heads = [], [], [], [], []
    for i, file in enumerate(files):
        try:
            log = logs.read(file.path)
            course = courses.course(log, file.condition.speed_mps, file.condition.angle_deg)
            feature_rows.append(features(log, course))
            channel_arrays.append(channels(log))
            usable.append(course)
            heads.append(log.slice(0, 1))
        except AirTouchError as error:
            left_out.append((str(file.path), str(error)))
        progress(i + 1, len(files))
    if not usable:
        raise AirTouchError(left_out[0][1])
    if len(usable) < MIN_FLIGHTS:
        why = f"; {left_out[0][1]}" if left_out else ""
        raise AirTouchError(f"{len(usable)} of {len(files)} flights can be used and {MIN_FLIGHTS} are needed: fly "
                            f"straight over the platform's two edges {MIN_FLIGHTS - len(usable)} more times, at two "
                            f"heights{why}")
    near = near_range.measure(usable, channel_arrays)
    if near is not None:
        usable = [replace(c, top_m=near.top_m) for c in usable]
    return RecordedFlights(courses.one_vehicle(heads), usable, channel_arrays, np.array(feature_rows), left_out, near)
