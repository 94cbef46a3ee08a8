"""Resampling of a flight to a constant rate. No reader does it by itself."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.alignment import GAP_PERIODS, hold, hold_of, hold_range, oldest_range_s
from airtouch.logs.checks.clock import FASTEST_S, SLOWEST_S, regular_time, rising_subsequence, true_period
from airtouch.logs.flight_log import LARGEST_BYTES, PWM, RANGES, FlightLog

LONGEST_BRIDGE_S = 0.1  #: s; longer gaps become NaN, unless they are within GAP_PERIODS; not of HELD
CUTOFF = 0.4  #: corner of the anti-aliasing low-pass as a fraction of the new rate
HELD = ("zrange_m", *RANGES, "vbat_V")  #: slow or stepping channels, resampled by holding the last value, unfiltered
ANGLES = ("roll_rad", "pitch_rad", "yaw_rad")
MOST_GROWTH = 100  #: most samples, at the old or the new rate, for each logged one
ALWAYS_SAMPLES = 10_000  #: samples that are allowed whatever MOST_GROWTH says


def resample(log: FlightLog, rate_hz: float = 100.0) -> FlightLog:
    """The flight resampled to exactly `rate_hz`, with `t_s` from 0.

    To a lower rate a zero-phase Butterworth low-pass (8th order, forward and backward, corner at
    0.4 of the new rate) prevents aliasing. Values are interpolated linearly. Gaps longer than
    both 0.1 s and 1.5 sample periods become NaN. The down range holds its last value in gaps of at
    most 0.15 s (`alignment.hold_range`), so that no gap in it becomes a true edge; other ranges for
    0.25 s and the battery for 5 s (`alignment.hold_of`), or 1.5 sample periods where those are longer.
    meta["resampled"] describes this.
    Samples without a time, or out of order, are left out; a warning counts them.
    Raises AirTouchError for a rate outside 0.2 to 10000 Hz, a clock that stands still, and a
    result of more than 100 samples for each logged one or more than 1 GiB.
    """
    if not 1 / SLOWEST_S <= rate_hz <= 1 / FASTEST_S:
        raise AirTouchError(f"{log.source}: a rate of {rate_hz:g} Hz is not possible; "
                            f"give {1 / SLOWEST_S:g} to {1 / FASTEST_S:g} Hz")
    time_s, gaps = regular_time(log) if len(log) else (np.empty(0), [])
    order = rising_subsequence(time_s)
    time_s = time_s[order]
    period = true_period(time_s)
    if period is None:
        raise AirTouchError(f"{log.source}: its clock does not run, so it cannot be resampled; "
                            "correct t_s or leave it out")
    count = _count(log, float(time_s[-1] - time_s[0]), period, rate_hz)
    new_time = time_s[0] + np.arange(count) / rate_hz
    down = rate_hz < 0.98 / period
    columns = {name: values[order] for name, values in log.columns.items() if name != "t_s"}
    columns = _columns(columns, time_s, new_time, period, rate_hz if down else None)
    low_pass = f"zero-phase Butterworth, {CUTOFF * rate_hz:g} Hz" if down else "none"
    done = {"from_hz": 1.0 / period, "to_hz": rate_hz, "low_pass": low_pass,
            "lost_samples": sum(gap.lost for gap in gaps), "longest_bridge_s": LONGEST_BRIDGE_S,
            "left_out": len(log) - len(order)}
    notes = [f"resampled from {1.0 / period:.2f} to {rate_hz:g} Hz"]
    if done["left_out"]:
        notes.append(f"{done['left_out']} of {len(log)} samples have no time, or one out of order, and were left out")
    return FlightLog({"t_s": np.arange(count) / rate_hz} | columns,
                     {**log.meta, "resampled": done, "sample_period_s": 1.0 / rate_hz,
                      "warnings": [*log.meta.get("warnings", []), *notes]})


def _count(log: FlightLog, span_s: float, period: float, rate_hz: float) -> int:
    """Number of samples at the new rate. Raises AirTouchError if it, or that at the old rate, is too large."""
    finest = span_s * max(rate_hz, 1.0 / period) + 1
    if finest > max(MOST_GROWTH * len(log), ALWAYS_SAMPLES):
        raise AirTouchError(f"{log.source}: {len(log)} samples in {span_s:g} s would become {finest:.0f}; "
                            "correct t_s, cut the log to the flight or ask for a lower rate")
    count = int(np.floor(span_s * rate_hz + 1e-6)) + 1
    if count * len(log.columns) * 8 > LARGEST_BYTES:
        raise AirTouchError(f"{log.source}: {count} samples at {rate_hz:g} Hz are more than 1 GiB; "
                            "ask for a lower rate or split the log")
    return count


def _columns(columns: dict[str, np.ndarray], time_s: np.ndarray, new_time: np.ndarray, period: float,
             low_pass_for: float | None) -> dict[str, np.ndarray]:
    """The channels at the new times. Channels that are valid at the same samples are filtered together."""
    low_pass = _low_pass(period, low_pass_for) if low_pass_for else None
    alike: dict[bytes, list[str]] = {}
    new: dict[str, np.ndarray] = {}
    for name, values in columns.items():
        valid = np.isfinite(values)
        if name == "zrange_m" and valid.any():
            new[name] = hold_range(time_s[valid], values[valid], new_time, oldest_range_s(period))
        elif name in HELD and valid.any():
            longest_s = max(hold_of(name), GAP_PERIODS * period)
            new[name] = hold(time_s[valid], values[valid], new_time, longest_s)
        else:
            alike.setdefault(valid.tobytes(), []).append(name)
    for mask, names in alike.items():
        valid = np.frombuffer(mask, dtype=bool)
        values = np.array([columns[name][valid] for name in names])
        for name in set(names) & set(ANGLES):
            values[names.index(name)] = np.unwrap(values[names.index(name)])
        values = _at(values, time_s[valid], new_time, period, low_pass)
        new |= dict(zip(names, values, strict=True))
    for name in set(new) & set(ANGLES):
        new[name] = np.angle(np.exp(1j * new[name]))
    for name in set(new) & set(PWM if low_pass else ()):
        new[name] = np.clip(new[name], 0, 65535)
    return {name: new[name] for name in columns}


def _at(values: np.ndarray, time_s: np.ndarray, new_time: np.ndarray, period: float,
        low_pass: tuple[np.ndarray, int] | None) -> np.ndarray:
    """Channels (k, n) at the new times, (k, m); NaN in gaps longer than both limits of a bridge."""
    new = np.full((len(values), len(new_time)), np.nan)
    bridge = max(LONGEST_BRIDGE_S, GAP_PERIODS * period)
    bounds = np.r_[0, np.flatnonzero(np.diff(time_s) > bridge) + 1, len(time_s)]
    for start, stop in zip(bounds[:-1], bounds[1:], strict=True):
        if stop == start:
            continue
        t, v = time_s[start:stop], values[:, start:stop]
        first, last = np.searchsorted(new_time, (t[0] - 1e-9, t[-1] + 1e-9))
        at = new_time[first:last]
        t, v = _smooth(t, v, period, *low_pass) if low_pass else (t, v)
        for row, one in zip(new, v, strict=True):
            row[first:last] = np.interp(at, t, one)
    return new


def _low_pass(period: float, rate_hz: float) -> tuple[np.ndarray, int]:
    """The low-pass in second-order sections, and the samples that it needs before and after."""
    from scipy.signal import butter  # slow to import, and seldom needed

    return butter(8, CUTOFF * rate_hz, fs=1.0 / period, output="sos"), int(3.0 / (CUTOFF * rate_hz * period)) + 1


def _smooth(t: np.ndarray, v: np.ndarray, period: float, sos: np.ndarray,
            padding: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (m,) of an even grid at the old rate, and channels (k, m) low-passed on it.

    Intervals that are too short for the filter stay unfiltered.
    """
    from scipy.signal import sosfiltfilt

    grid = t[0] + np.arange(int(np.floor((t[-1] - t[0]) / period + 1e-6)) + 1) * period
    if len(grid) < 4:
        return t, v
    even = np.array([np.interp(grid, t, one) for one in v])
    return grid, sosfiltfilt(sos, even, padlen=min(len(grid) - 1, padding))
