"""A log on a regular 10 ms clock, with a row of NaN for each one that was lost.

A faster log is resampled, a slower one refused.
"""

from typing import NamedTuple

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.logs.checks.clock import LEAST_AFTER, lost_samples, sample_period, true_period
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.resample import resample

PERIOD_S = 0.01
#: share by which a log's period may differ from PERIOD_S and count as equal; chosen: CrazyPAD's clocks are off by 1.2 %
PERIOD_TOLERANCE = 0.02
BACKWARDS_S = 0.05  #: step back of the clock that is no jitter: such a log is refused; chosen
#: most rows with the lost ones, else the clock column is at fault: so many for each logged one, and some more; chosen
MOST_ROWS_EACH, MOST_ROWS_MORE = 3, 1000
LEAST_JITTER_S = 2e-4  #: s, rms of a clock that nothing disturbs: a jitter below it says nothing; chosen
MISSING = 1.5  #: step, in periods, from which a row is missing: nearer to two periods than to one


def at_100_hz(log: FlightLog, name: str) -> FlightLog:
    """The log, resampled to 100 Hz where it is faster by more than PERIOD_TOLERANCE. It has two samples at least.

    Raises AirTouchError, with the file `name`, where the clock runs backwards, and for a slower log: what it lacks of
    the band up to 50 Hz cannot be made up.
    """
    if log.has("t_s"):
        known = np.flatnonzero(np.isfinite(log["t_s"]))
        steps = np.diff(log["t_s"][known])
        if (steps < -BACKWARDS_S).any():
            first = int(np.argmax(steps < -BACKWARDS_S))
            raise AirTouchError(f"{name}, sample {known[first + 1]}: the clock runs backwards by "
                                f"{-steps[first]:.3f} s; cut the log there")
    time = interpolate_missing(log["t_s"]) if log.has("t_s") else np.arange(len(log)) * sample_period(log)
    period = true_period(time) or PERIOD_S
    # lost rows lengthen the mean step, not the median
    least_period = min(period, float(np.median(np.diff(time))))
    if least_period > (1.0 + PERIOD_TOLERANCE) * PERIOD_S:
        raise AirTouchError(f"{name}: logged at {1.0 / least_period:.3g} Hz; the diagnosis needs 100 Hz or more: log "
                            "every 10 ms")
    return resample(log, 100.0) if period < (1.0 - PERIOD_TOLERANCE) * PERIOD_S else log


class RegularLog(NamedTuple):
    """A log on a regular clock. clock_s (m,), lost (n,): as in `flight.Flight`."""

    log: FlightLog
    clock_s: np.ndarray
    lost: np.ndarray


def with_lost_rows(log: FlightLog, name: str) -> RegularLog:
    """The log on a regular clock, its lost rows put back as NaN.

    Raises AirTouchError, with the file `name`, where most of the rows are missing.
    """
    n = len(log)
    if not log.has("t_s"):
        return RegularLog(log, np.zeros(n), np.zeros(n, bool))
    time = interpolate_missing(log["t_s"])
    period = true_period(time) or PERIOD_S
    place = np.arange(n)  # of each logged row among all
    for hole in lost_samples(time, period):
        place[hole.sample:] += hole.lost
    rows = place[-1] + 1
    if rows > MOST_ROWS_EACH * n + MOST_ROWS_MORE + 1:
        raise AirTouchError(f"{name}: {rows - n} of {rows} samples are missing; check the clock column")
    sure = n - _rows_in_doubt(time, period)
    clock = _off_a_line(time, place, sure) if sure > 2 else np.zeros(n)
    lost = np.ones(rows, bool)
    lost[place] = False
    columns = {}
    for key, values in log.columns.items():
        columns[key] = np.full(len(lost), np.nan)
        columns[key][place] = values
    columns["t_s"] = np.arange(len(lost)) * PERIOD_S
    return RegularLog(FlightLog(columns, {**log.meta, "sample_period_s": PERIOD_S}), clock, lost)


def row_times(log: FlightLog, name: str) -> np.ndarray:
    """Times (n,), s, by the clock of a log with t_s, of the rows that `with_lost_rows` makes of it `at_100_hz`.

    Raises as these two.
    """
    at_rate = at_100_hz(log, name)
    lost = with_lost_rows(at_rate, name).lost
    times = np.full(len(lost), np.nan)
    logged = interpolate_missing(log["t_s"])  # the resampled clock begins at the first known time
    times[~lost] = logged if at_rate is log else logged[0] + at_rate["t_s"]
    return interpolate_missing(times)


def _off_a_line(time: np.ndarray, place: np.ndarray, sure: int) -> np.ndarray:
    """Distance (sure,), s, of the first times, as many as are sure, from a straight line over their places."""
    return (time - np.polyval(np.polyfit(place[:sure], time[:sure], 1), place))[:sure]


def _rows_in_doubt(time: np.ndarray, period: float) -> int:
    """Rows at the end after which too few follow to say whether rows before them were lost or these came late."""
    steps = np.flatnonzero(np.diff(time[-LEAST_AFTER - 1:]) > MISSING * period)
    return min(len(time), LEAST_AFTER) - int(steps[0]) if len(steps) else 0
