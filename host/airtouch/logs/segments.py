"""Phases of a flight: ground, take-off, hover, cruise, platform, landing."""

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np

from airtouch.logs.checks.clock import sample_period
from airtouch.logs.edges import Edge, true_edges
from airtouch.logs.flight_log import VELOCITY, FlightLog
from airtouch.logs.in_flight import airborne, height_column
from airtouch.parameters import DEFAULT

CRUISE_MPS = 0.1  #: m/s, horizontal speed above which level flight is cruise
LEAST_HEIGHT_M = 0.05  #: m; a drone that stays below it with its motors on has not taken off
LEVEL_PART = 0.85  #: fraction of the median height at which take-off ends and landing starts
HIGH_PART = 0.5  #: fraction of the median height from which on a log that begins or ends in the air was cut; chosen
PLATFORM_STEP_M = 0.12  #: m, least step of the down range at a platform's edge; low platforms included
KINDS = ("ground", "take-off", "hover", "cruise", "over platform", "landing")


@dataclass(frozen=True)
class Segment:
    """A phase of a flight: samples start to stop - 1."""

    kind: str  #: one of KINDS
    start: int
    stop: int


def segments(log: FlightLog, arm_pwm: float = DEFAULT.arm_pwm) -> list[Segment]:
    """The phases of a flight in order; every sample is in one of them.

    Ground: motors below the airborne level, or never higher than 5 cm where a height was measured. Take-off: until
    85 % of the median height in the air; landing: from the last time at that height. A log that begins or ends in the
    air, half of the median height up or more, has no take-off or no landing there.
    Over platform: from an entry to its exit by the down range, or to the landing where none follows. The rest is cruise
    where the speed is above 0.1 m/s, else hover; without velocity it is all cruise if
    the flight crosses an edge, else all hover. arm_pwm: the airborne level, of a vehicle's
    file. Raises AirTouchError for a log with neither PWM nor height.
    """
    period = sample_period(log)
    flying = _without_short_runs(airborne(log, arm_pwm), int(0.5 / period))
    kinds = np.zeros(len(log), dtype=np.int8)
    edges = true_edges(log, PLATFORM_STEP_M, arm_pwm) if log.has("zrange_m") else []
    edges = [e for e in edges if flying[e.sample]]
    ground_height = _height(log, edges)
    at = [e.sample for e in edges]
    for start, stop in runs(flying):
        here = slice(start, stop)
        crossing = edges[bisect_left(at, start):bisect_left(at, stop)]
        kinds[here] = KINDS.index("cruise" if crossing and not log.has(*VELOCITY[:2]) else "hover")
        if log.has(*VELOCITY[:2]):
            speed = np.hypot(log[VELOCITY[0]][here], log[VELOCITY[1]][here])
            moving = _without_short_runs(_smooth(speed, int(0.5 / period)) > CRUISE_MPS, int(0.3 / period))
            kinds[here][moving] = KINDS.index("cruise")
        measured = np.isfinite(ground_height[here]).any()
        if measured and not np.any(ground_height[here] > LEAST_HEIGHT_M):
            kinds[here] = KINDS.index("ground")
        elif measured:
            _ends(kinds[here], ground_height[here], start == 0, stop == len(log))
        descent = int(np.argmax(np.r_[kinds[here] == KINDS.index("landing"), True])) + start
        for edge, end in zip(crossing, [*(e.sample for e in crossing[1:]), descent], strict=False):
            if edge.kind == "entry":
                kinds[edge.sample:end] = KINDS.index("over platform")
    return [Segment(KINDS[kinds[start]], start, stop) for start, stop in _constant_runs(kinds)]


def _height(log: FlightLog, edges: list[Edge]) -> np.ndarray:
    """Height above the ground, (n,) m, NaN if unknown; over a platform the down range plus the platform's height."""
    column = height_column(log)
    height = log[column] if log.has(column) else np.full(len(log), np.nan)
    if column == "zrange_m":
        steps, total = np.zeros(len(log) + 1), 0.0
        for edge in edges:
            step = edge.height_before_m - edge.height_after_m if edge.kind == "entry" else -total
            steps[edge.sample] += step
            total += step
        return height + np.cumsum(steps[:-1])
    return height


def _ends(kinds: np.ndarray, height: np.ndarray, begins_log: bool, ends_log: bool) -> None:
    """Mark take-off and landing in `kinds`, (n,), in place; none where the log begins or ends high in the air."""
    if not np.isfinite(height).any():
        return
    known, median = height[np.isfinite(height)], np.nanmedian(height)
    level = np.flatnonzero(height >= LEVEL_PART * median)
    if not begins_log or known[0] < HIGH_PART * median:
        kinds[:level[0]] = KINDS.index("take-off")
    if not ends_log or known[-1] < HIGH_PART * median:
        kinds[level[-1] + 1:] = KINDS.index("landing")


def _smooth(values: np.ndarray, width: int) -> np.ndarray:
    width = max(min(width, len(values)), 1)
    finite = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
    return np.convolve(finite, np.full(width, 1.0 / width), mode="same")


def runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """Start and stop of each run of True in (n,) bool."""
    return [(a, b) for a, b in _constant_runs(mask) if mask[a]]


def _constant_runs(values: np.ndarray) -> list[tuple[int, int]]:
    if not len(values):
        return []
    bounds = np.r_[0, np.flatnonzero(values[1:] != values[:-1]) + 1, len(values)]
    return [(int(a), int(b)) for a, b in zip(bounds[:-1], bounds[1:], strict=True)]


def _without_short_runs(mask: np.ndarray, shortest: int) -> np.ndarray:
    """The mask without gaps, then without runs, shorter than `shortest` samples; those at the log's ends stay."""
    mask = mask.copy()
    for value in (False, True):
        for start, stop in _constant_runs(mask):
            inner = start > 0 and stop < len(mask)
            if mask[start] == value and stop - start < shortest and (inner or value):
                mask[start:stop] = not value
    return mask
