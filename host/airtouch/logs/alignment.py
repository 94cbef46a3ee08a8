"""Signals with different sample times, aligned to one clock of 100 Hz."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import ACC, GYRO, FlightLog
from airtouch.parameters import SAMPLE_PERIOD_S

HOLD_S = 0.25  #: s for which the last value of a signal is repeated; after that the sample is NaN
#: s, the longest gap between readings of the down range that is bridged; a step over a longer one is no true edge.
#: Chosen: 3 readings at 24 Hz
OLDEST_RANGE_S = 0.15
GAP_PERIODS = 1.5  #: sample periods that are always bridged: one of a slow log exceeds the limits in seconds
ROUNDING_S = 1e-6  #: s, added to the longest gap, so that one of exactly 0.15 s is bridged in floating point
HOLD_BATTERY_S = 5.0  #: s, the same of the battery, which is often logged at 1 Hz or less and changes slowly; chosen
Signal = tuple[np.ndarray, np.ndarray]  #: times (n,) in s and values (n,)


def aligned_log(signals: Mapping[str, Signal], meta: Mapping[str, Any]) -> FlightLog:
    """The flight log at 100 Hz of signals {column: (times, values)}.

    Accelerations and rates that were sampled faster than 100 Hz are averaged over each 10 ms. Any other signal repeats
    its last value for at most HOLD_S, the battery for HOLD_BATTERY_S, the down range as of `hold_range`. The clock
    starts with the first acceleration or rate. A column without a value in its time gives a warning. Raises
    AirTouchError if there is neither.
    """
    signals = {name: _sorted(*signal) for name, signal in signals.items() if len(signal[0])}
    imu_times = [signals[name][0] for name in (*GYRO, *ACC) if name in signals]
    if not imu_times:
        raise AirTouchError(f"{meta['source']}: neither accelerations nor rates in this file; log the IMU")
    begin, end = min(t[0] for t in imu_times), max(t[-1] for t in imu_times)
    if not 0.0 <= end - begin < 86400.0:
        raise AirTouchError(f"{meta['source']}: its clock spans {end - begin:.0f} s; this is no flight")
    clock = np.arange(begin, end + 0.5 * SAMPLE_PERIOD_S, SAMPLE_PERIOD_S)
    columns = {"t_s": clock - begin}
    for name, (times, values) in signals.items():
        fast = name in (*GYRO, *ACC) and np.median(np.diff(times)) < 0.75 * SAMPLE_PERIOD_S if len(times) > 1 else False
        if name == "zrange_m":
            columns[name] = hold_range(times, values, clock, oldest_range_s(SAMPLE_PERIOD_S))
        else:
            columns[name] = _average(times, values, clock) if fast else hold(times, values, clock, hold_of(name))
    empty = [f"{name} is empty: no value while the IMU was logged" for name, values in columns.items()
             if not np.isfinite(values).any()]
    return FlightLog(columns, {"condition": "", **meta, "warnings": [*meta.get("warnings", []), *empty]})


def _sorted(times: np.ndarray, values: np.ndarray) -> Signal:
    times, values = np.asarray(times, float), np.asarray(values, float)
    timed = np.isfinite(times)
    order = np.argsort(times[timed], kind="stable")
    return times[timed][order], values[timed][order]


def _average(times: np.ndarray, values: np.ndarray, clock: np.ndarray) -> np.ndarray:
    """Mean of the values within half a period of each tick, (m,); the last value before it where there are none."""
    tick = np.floor((times - clock[0]) / SAMPLE_PERIOD_S + 0.5).astype(int)
    usable = (tick >= 0) & (tick < len(clock)) & np.isfinite(values)
    count = np.bincount(tick[usable], minlength=len(clock))
    total = np.bincount(tick[usable], values[usable], minlength=len(clock))
    return np.where(count > 0, total / np.maximum(count, 1), hold(times, values, clock, HOLD_S))


def hold_of(name: str) -> float:
    """Seconds for which a column's last value is repeated."""
    return HOLD_BATTERY_S if name == "vbat_V" else HOLD_S


def oldest_range_s(period_s: float) -> float:
    """The longest gap in s between two readings of the down range that is bridged, in a log of this sample period."""
    return max(OLDEST_RANGE_S, GAP_PERIODS * period_s) + ROUNDING_S


def hold_range(times: np.ndarray, values: np.ndarray, clock: np.ndarray, longest_s: float) -> np.ndarray:
    """The last down range before each tick, (m,); NaN in gaps between readings that are longer than `longest_s`.

    Such a gap stays longer than `longest_s`, also where ticks and readings lie apart, so that a step over it remains
    no true edge.
    """
    valid = np.flatnonzero(np.isfinite(values))
    gap = np.diff(times[valid])
    tick_s = clock[1] - clock[0] if len(clock) > 1 else np.inf
    longest = np.full(len(times), longest_s)
    longest[valid[:-1]] = np.where(gap <= longest_s, longest_s, np.minimum(gap - longest_s, tick_s) - 1e-9)
    return hold(times, values, clock, longest)


def hold(times: np.ndarray, values: np.ndarray, clock: np.ndarray, longest_s: float | np.ndarray) -> np.ndarray:
    """The last value before each tick, (m,); NaN where it is missing or older than `longest_s`, one or one a value."""
    last = np.searchsorted(times, clock + 1e-9, side="right") - 1
    longest = np.broadcast_to(longest_s, np.shape(times))[np.maximum(last, 0)]
    recent = (last >= 0) & (clock - times[np.maximum(last, 0)] <= longest)
    return np.where(recent, values[np.maximum(last, 0)], np.nan)
