"""Signals with different sample times, aligned to one clock of 100 Hz."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import ACC, GYRO, FlightLog
from airtouch.parameters import SAMPLE_PERIOD_S

HOLD_S = 0.25  #: s for which the last value of a signal is repeated; after that the sample is NaN
HOLD_BATTERY_S = 5.0  #: s, the same of the battery, which is often logged at 1 Hz or less and changes slowly; chosen
Signal = tuple[np.ndarray, np.ndarray]  #: times (n,) in s and values (n,)


def aligned_log(signals: Mapping[str, Signal], meta: Mapping[str, Any]) -> FlightLog:
    """The flight log at 100 Hz of signals {column: (times, values)}.

    Accelerations and rates that were sampled faster than 100 Hz are averaged over each 10 ms. Any other signal repeats
    its last value for at most HOLD_S, the battery for HOLD_BATTERY_S. The clock starts with the first acceleration or
    rate. A column without a value in its time gives a warning. Raises AirTouchError if there is neither.
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


def hold(times: np.ndarray, values: np.ndarray, clock: np.ndarray, longest_s: float) -> np.ndarray:
    """The last value before each tick, (m,); NaN where it is older than `longest_s` or missing."""
    last = np.searchsorted(times, clock + 1e-9, side="right") - 1
    recent = (last >= 0) & (clock - times[np.maximum(last, 0)] <= longest_s)
    return np.where(recent, values[np.maximum(last, 0)], np.nan)
