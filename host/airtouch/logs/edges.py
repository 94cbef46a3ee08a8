"""True edges, from steps of the down range. They are ground truth: no detector reads the down range."""

from dataclasses import dataclass

import numpy as np

from airtouch.logs.alignment import oldest_range_s
from airtouch.logs.checks.clock import regular_time, sample_period
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.in_flight import airborne
from airtouch.parameters import DEFAULT

STEP_M = 0.30  #: m, least change of the down range within two samples at an edge
ROUNDING_M = 1e-6  #: m, added to STEP_M, so that a step of exactly 0.30 m is no edge in floating point
SETTLING_S = 0.10  #: s; the 24 to 40 Hz sensor may need two or three readings to settle after a step
LEVEL_S = 0.10  #: s before and after an edge over which the heights are averaged
IN_FLIGHT_S = 0.25  #: s before and after an edge in which the drone must fly


@dataclass(frozen=True)
class Edge:
    """A crossing of a platform's edge: kind `entry` where the down range falls, `exit` where it rises."""

    sample: int
    kind: str
    height_before_m: float
    height_after_m: float


def true_edges(log: FlightLog, step_m: float = STEP_M, arm_pwm: float = DEFAULT.arm_pwm) -> list[Edge]:
    """True edges of a flight in order of time.

    An edge is the first sample at which the down range falls (entry) or rises (exit) by more
    than `step_m` within two samples, in flight. Steps within 0.1 s of it are the sensor settling
    and belong to it. A step that is undone within 0.1 s is a glitch and no edge. A step over more
    than 0.15 s (and 1.5 sample periods) without a valid reading or a row is none either. Low
    platforms need a `step_m` below 0.30. arm_pwm: as of `airborne`. Raises AirTouchError for a
    log without `zrange_m`.
    """
    height = _filled_forward(log["zrange_m"])
    period = sample_period(log)
    steps = np.flatnonzero(_steps(height, step_m) & _in_flight(log, arm_pwm))
    steps = steps[~_after_gap(log, period)[steps]] if len(steps) else steps
    settling = max(int(round(SETTLING_S / period)), 2)
    level = max(int(round(LEVEL_S / period)), 1)
    edges: list[Edge] = []
    settled = 0
    for sample in map(int, steps):
        if sample < settled:
            continue
        settled = sample + settling
        before = float(np.median(height[max(sample - max(level, 2), 0):max(sample - 1, 1)]))
        later = height[settled:settled + level]
        after = float(np.median(later)) if len(later) else float(height[-1])
        if abs(after - before) > step_m:
            edges.append(Edge(sample, "entry" if after < before else "exit", before, after))
    return edges


def _steps(height: np.ndarray, step_m: float) -> np.ndarray:
    """True where the range changed by more than step_m over the last one or two samples, (n,) bool."""
    moved = np.zeros(len(height), dtype=bool)
    for lag in (1, 2):
        moved[lag:] |= np.abs(height[lag:] - height[:-lag]) > step_m + ROUNDING_M
    return moved


def _after_gap(log: FlightLog, period: float) -> np.ndarray:
    """True for the first two samples after a gap in the down range, by invalid readings or lost rows, (n,) bool."""
    time_s, _ = regular_time(log)
    valid = np.flatnonzero(np.isfinite(log["zrange_m"]) & np.isfinite(time_s))
    gap = np.diff(time_s[valid]) > oldest_range_s(period)
    after = np.zeros(len(log) + 1, dtype=bool)
    after[valid[1:][gap]] = after[valid[1:][gap] + 1] = True
    return after[:-1]


def _in_flight(log: FlightLog, arm_pwm: float) -> np.ndarray:
    """True where the drone is airborne now and for IN_FLIGHT_S before and after, (n,) bool."""
    margin = max(int(round(IN_FLIGHT_S / sample_period(log))), 1)
    n = len(log)
    if n <= 2 * margin:
        return np.zeros(n, dtype=bool)
    grounded = np.r_[0, np.cumsum(~airborne(log, arm_pwm))]
    place = np.arange(n)
    return grounded[np.minimum(place + margin + 1, n)] == grounded[np.maximum(place - margin, 0)]


def _filled_forward(values: np.ndarray) -> np.ndarray:
    """The values, (n,), with NaN replaced by the last valid one; at the start by the first valid one."""
    valid = np.isfinite(values)
    if valid.all() or not valid.any():
        return np.where(valid, values, 0.0)
    last = np.maximum.accumulate(np.where(valid, np.arange(len(values)), -1))
    return values[np.where(last < 0, np.flatnonzero(valid)[0], last)]
