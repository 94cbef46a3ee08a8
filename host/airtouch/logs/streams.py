"""Signals with different sample times, resampled to one clock of 100 Hz."""

from collections.abc import Mapping

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import ACC, GYRO, FlightLog

PERIOD_S = 0.01  #: s, sample time of the resulting log
HELD_S = 0.25  #: s for which a value is held; after that the sample is NaN
Stream = tuple[np.ndarray, np.ndarray]  #: times (n,) in s and values (n,)


def log_of(streams: Mapping[str, Stream], meta: Mapping[str, object]) -> FlightLog:
    """The flight log at 100 Hz of signals {column: (times, values)}.

    Accelerations and rates that were sampled faster than 100 Hz are averaged over each 10 ms. Any other signal holds
    its last value for at most HELD_S. The clock starts with the first acceleration or rate. Raises AirTouchError if
    there is neither.
    """
    streams = {name: _sorted(*pair) for name, pair in streams.items() if len(pair[0])}
    leading = [streams[name][0] for name in (*GYRO, *ACC) if name in streams]
    if not leading:
        raise AirTouchError(f"{meta['source']}: neither accelerations nor rates in this file; log the IMU")
    begin, end = min(t[0] for t in leading), max(t[-1] for t in leading)
    if not 0.0 <= end - begin < 86400.0:
        raise AirTouchError(f"{meta['source']}: its clock spans {end - begin:.0f} s; this is no flight")
    clock = np.arange(begin, end + 0.5 * PERIOD_S, PERIOD_S)
    columns = {"t_s": clock - begin}
    for name, (times, values) in streams.items():
        fast = name in (*GYRO, *ACC) and np.median(np.diff(times)) < 0.75 * PERIOD_S if len(times) > 1 else False
        columns[name] = _averaged(times, values, clock) if fast else _held(times, values, clock)
    return FlightLog(columns, {"condition": "", "warnings": [], **meta})


def _sorted(times: np.ndarray, values: np.ndarray) -> Stream:
    times, values = np.asarray(times, float), np.asarray(values, float)
    good = np.isfinite(times)
    order = np.argsort(times[good], kind="stable")
    return times[good][order], values[good][order]


def _averaged(times: np.ndarray, values: np.ndarray, clock: np.ndarray) -> np.ndarray:
    """Mean of the values within half a period of each tick, (m,); the held value where there are none."""
    place = np.floor((times - clock[0]) / PERIOD_S + 0.5).astype(int)
    inside = (place >= 0) & (place < len(clock)) & np.isfinite(values)
    count = np.bincount(place[inside], minlength=len(clock))
    total = np.bincount(place[inside], values[inside], minlength=len(clock))
    return np.where(count > 0, total / np.maximum(count, 1), _held(times, values, clock))


def _held(times: np.ndarray, values: np.ndarray, clock: np.ndarray) -> np.ndarray:
    """The last value before each tick, (m,); NaN where it is older than HELD_S or missing."""
    last = np.searchsorted(times, clock + 1e-9, side="right") - 1
    known = (last >= 0) & (clock - times[np.maximum(last, 0)] <= HELD_S)
    return np.where(known, values[np.maximum(last, 0)], np.nan)
