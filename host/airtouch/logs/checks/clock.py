"""The clock of a log: sample period, lost samples, and samples with rising times."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass

import numpy as np

from airtouch.logs.flight_log import FlightLog

WINDOW = 100  #: samples before and after a suspected loss over which the least delay is taken
LEAST_AFTER = 20  #: samples that must follow a loss; fewer may be a burst of late packets at the end
FASTEST_S = 1e-4  #: s, shortest sample period accepted; the fastest IMU on a Crazyflie gives 6.7 kHz
SLOWEST_S = 5.0  #: s, longest sample period accepted; the firmware's slowest log block comes every 2.55 s
ALIKE = 0.02  #: share of the median step by which a step may differ from one or more of it; chosen
MOST_ALIKE = 0.7  #: share of such steps above which the longer ones may be lost samples; chosen
LATEST_S = 1e10  #: s, largest time accepted; a clock that counts from 1970 shows 1.8e9


@dataclass(frozen=True)
class Gap:
    """A gap in a log: the index of the first sample after it, samples lost, and its length in seconds."""

    sample: int
    lost: int
    seconds: float


def sample_period(log: FlightLog) -> float:
    """Sample period in seconds: meta["sample_period_s"], else the clock's median step, else 0.01."""
    known = log.meta.get("sample_period_s")
    if isinstance(known, (int, float)) and FASTEST_S <= known <= SLOWEST_S:
        return float(known)
    if log.has("t_s") and len(log) > 1:
        with np.errstate(invalid="ignore", over="ignore"):
            steps = np.diff(log["t_s"])
        steps = steps[np.isfinite(steps) & (steps > 0)]
        if len(steps) and FASTEST_S <= np.median(steps) <= SLOWEST_S:
            return float(np.median(steps))
    return 0.01


def true_period(time_s: np.ndarray) -> float | None:
    """Sample period in seconds: the median slope of time over the place among all samples, lost ones included.

    Where most steps are one or more whole median steps, fewer than half of the samples may be lost. Elsewhere, as in a
    clock of packets that come in bursts, the place is the index, and the slope is robust to a few lost ones.
    None for a clock that stands still or runs backwards, and for a period outside 0.0001 to 5 s.
    """
    lag = max(min(500, len(time_s) // 16), min(50, len(time_s) // 4), 1)
    if len(time_s) < 2:
        return None
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        place = _places(time_s)
        slopes = (time_s[lag:] - time_s[:-lag]) / (place[lag:] - place[:-lag])
    slopes = slopes[np.isfinite(slopes)]
    period = float(np.median(slopes)) if len(slopes) else 0.0
    return period if FASTEST_S <= period <= SLOWEST_S else None


def _places(time_s: np.ndarray) -> np.ndarray:
    """Place of each sample among all, (n,): its index, plus the samples lost before it where the clock is even."""
    steps = np.diff(time_s)
    known = steps[np.isfinite(steps)]
    median = float(np.median(known)) if len(known) else 0.0
    place = np.arange(len(time_s), dtype=np.float64)
    if not median > 0.0:
        return place
    periods = np.round(steps / median)
    if np.mean((periods != 0.0) & (np.abs(steps - periods * median) < ALIKE * median)) <= MOST_ALIKE:
        return place
    for gap in lost_samples(time_s, median):
        place[gap.sample:] += gap.lost
    return place


def lost_samples(time_s: np.ndarray, period: float) -> list[Gap]:
    """Gaps in which samples were lost. Samples without a time, or with one out of order, are skipped. period: s.

    Arrival times are late in bursts and then catch up; that is no loss. Samples are lost where
    the least delay of the next WINDOW samples is at least 0.7 periods above that of the WINDOW before.
    """
    time_s = np.asarray(time_s, dtype=np.float64)
    with np.errstate(invalid="ignore"):
        place = np.flatnonzero(np.abs(time_s) <= LATEST_S)
    place = place[rising_subsequence(time_s[place], repeats=True)]
    if len(place) < 3:
        return []
    time_s = time_s[place]
    delay = time_s - period * place
    gaps: list[Gap] = []
    since = 0
    late = np.diff(time_s[:-LEAST_AFTER]) - period * (np.diff(place[:-LEAST_AFTER]) - 1)
    for sample in np.flatnonzero(late > 1.5 * period) + 1:
        before = delay[max(since, sample - WINDOW):sample].min()
        after = delay[sample:sample + WINDOW].min()
        lost = int(round((after - before) / period))
        if after - before > 0.7 * period and lost >= 1:
            gaps.append(Gap(int(place[sample]), lost, float(time_s[sample] - time_s[sample - 1])))
            since = int(sample)
    return gaps


def regular_time(log: FlightLog) -> tuple[np.ndarray, list[Gap]]:
    """Times at which the samples were taken, (n,) s from the first that has a time, and the gaps.

    A log with meta["sample_period_s"] holds arrival times. Its times are index times period, plus
    the samples lost so far. Any other log holds the drone's own clock, which is used as it is.
    """
    clock = log["t_s"] if log.has("t_s") else np.arange(len(log)) * sample_period(log)
    stated = log.meta.get("sample_period_s")
    if stated is None and log.has("t_s"):
        period = true_period(clock) or sample_period(log)
        start = clock[np.isfinite(clock)][:1]
        with np.errstate(over="ignore"):
            return clock - (start[0] if len(start) else 0.0), lost_samples(clock, period)
    period = sample_period(log)
    gaps = lost_samples(clock, true_period(clock) or period)
    shift = np.zeros(len(log))
    for gap in gaps:
        shift[gap.sample] += gap.lost
    return (np.arange(len(log)) + np.cumsum(shift)) * period, gaps


def rising_subsequence(time_s: np.ndarray, repeats: bool = False) -> np.ndarray:
    """Indices of the longest subsequence with rising times: a wrong time costs its own sample and no other.

    repeats: samples with equal times stay, too.
    """
    place = np.flatnonzero(np.isfinite(time_s))
    times = time_s[place]
    steps = np.diff(times)
    if not ((steps < 0) if repeats else (steps <= 0)).any():
        return place
    bisect = bisect_right if repeats else bisect_left
    ends: list[float] = []  # ends[k]: least last time of such a sequence of k + 1 samples
    last: list[int] = []  # which sample that is
    before = np.empty(len(times), dtype=np.intp)
    for i, time in enumerate(times.tolist()):
        length = bisect(ends, time)
        before[i] = last[length - 1] if length else -1
        ends[length:length + 1], last[length:length + 1] = [time], [i]
    path, i = [], last[-1]
    while i >= 0:
        path.append(i)
        i = int(before[i])
    return place[path[::-1]]
