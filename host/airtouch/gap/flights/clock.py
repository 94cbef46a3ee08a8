"""A log on a regular 10 ms clock: resampled where it is faster, with a row of NaN for each one that was lost."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.logs.checks.clock import LEAST_AFTER, lost_samples, true_period
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.resample import resample

PERIOD_S = 0.01
FAST_PERIOD_S = 0.006  #: a log whose period is shorter is resampled; chosen, between those of 100 Hz and of 200 Hz
BACKWARDS_S = 0.05  #: step back of the clock that is no jitter: such a log is refused; chosen
LONGEST, LONGEST_ROWS = 3, 1000  #: rows with the lost ones at most: so many times those logged, and more; chosen
ALIKE = 0.02  #: share of the median step by which a step may differ from it and count as alike; chosen
MOST_ALIKE = 0.7  #: share of the steps from which the mean of those alike is the period; chosen
LEAST_JITTER_S = 2e-4  #: s, rms of a clock that nothing disturbs: a jitter below it says nothing; chosen
MISSING = 1.5  #: step, in periods, from which a row is missing: nearer to two periods than to one


def at_100_hz(log: FlightLog, name: str) -> FlightLog:
    """The log, resampled to 100 Hz where its period is below FAST_PERIOD_S. It has two samples at least.

    Raises AirTouchError, with the file `name`, where the clock runs backwards.
    """
    if log.has("t_s"):
        backwards = np.flatnonzero(np.diff(log["t_s"]) < -BACKWARDS_S)
        if len(backwards):
            raise AirTouchError(f"{name}, sample {backwards[0] + 1}: the clock runs backwards by "
                                f"{-np.diff(log['t_s'])[backwards[0]]:.3f} s; cut the log there")
        period = true_period(log["t_s"])
        if period is not None and period < FAST_PERIOD_S:
            return resample(log, 100.0)
    return log


def with_lost_rows(log: FlightLog, name: str) -> tuple[FlightLog, np.ndarray, np.ndarray]:
    """The log (n rows) on a regular clock, its lost rows put back as NaN; see `Flight.clock_s` and `Flight.lost`.

    Raises AirTouchError, with the file `name`, where most of the rows are missing.
    """
    n = len(log)
    if not log.has("t_s"):
        return log, np.zeros(n), np.zeros(n, bool)
    time = interpolate_missing(log["t_s"])
    period = _period(time)
    place = np.arange(n)
    for gap in lost_samples(time, period):
        place[gap.sample:] += gap.lost
    if place[-1] > LONGEST * n + LONGEST_ROWS:
        raise AirTouchError(f"{name}: {place[-1] - n} of {place[-1]} samples are missing; check the clock column")
    known = n - _rows_in_doubt(time, period)
    clock = (time - np.polyval(np.polyfit(place[:known], time[:known], 1), place))[:known] if known > 2 else np.zeros(n)
    lost = np.ones(place[-1] + 1, bool)
    lost[place] = False
    columns = {}
    for key, values in log.columns.items():
        columns[key] = np.full(len(lost), np.nan)
        columns[key][place] = values
    columns["t_s"] = np.arange(len(lost)) * PERIOD_S
    meta = {**log.meta, "sample_period_s": PERIOD_S}
    return FlightLog(columns, meta), clock, lost


def _rows_in_doubt(time: np.ndarray, period: float) -> int:
    """Rows at the end after which too few follow to say whether rows before them were lost or these came late."""
    steps = np.flatnonzero(np.diff(time[-LEAST_AFTER - 1:]) > MISSING * period)
    return min(len(time), LEAST_AFTER) - int(steps[0]) if len(steps) else 0


def _period(time: np.ndarray) -> float:
    """The clock's period, s: the commonest step where most are alike, however many samples were lost."""
    steps = np.diff(time)
    median = float(np.median(steps)) if len(steps) else 0.0
    if median > 0.0 and np.mean(np.abs(steps - median) < ALIKE * median) > MOST_ALIKE:
        return float(steps[np.abs(steps - median) < ALIKE * median].mean())
    return true_period(time) or PERIOD_S
