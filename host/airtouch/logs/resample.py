"""Resampling to a steady rate, only ever on request."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.clock import regular_time, true_period
from airtouch.logs.flight_log import PWM, RANGES, FlightLog

LONGEST_BRIDGE_S = 0.1  #: gaps longer than this become NaN, never values
CUTOFF = 0.4  #: of the new rate: corner of the low-pass used when going down
HELD = ("zrange_m", *RANGES, "vbat_V")  #: slow or stepping channels: the last value is held, not filtered
ANGLES = ("roll_rad", "pitch_rad", "yaw_rad")


def resample(log: FlightLog, rate_hz: float = 100.0) -> FlightLog:
    """The flight at exactly `rate_hz`, `t_s` counting from 0.

    Going down, a zero-phase Butterworth low-pass (8th order forth and back, 0.4 of
    the new rate) keeps higher frequencies from folding in. Between samples values
    are interpolated linearly; ranges and battery hold their last value. What lies
    in a gap of more than 0.1 s is NaN. meta["resampled"] says all this.
    Raises AirTouchError for a rate that is not in (0, 10000] Hz and a log whose
    clock does not run.
    """
    if not 0 < rate_hz <= 10000:
        raise AirTouchError(f"{log.source}: a rate of {rate_hz:g} Hz is not possible; give 1 to 10000 Hz")
    time_s, gaps = regular_time(log) if len(log) else (np.empty(0), [])
    latest = np.maximum.accumulate(np.r_[-np.inf, np.where(np.isfinite(time_s), time_s, -np.inf)])[:-1]
    rising = np.isfinite(time_s) & (time_s > latest)
    time_s = time_s[rising]
    period = true_period(time_s)
    if len(time_s) < 2 or period is None:
        raise AirTouchError(f"{log.source}: its clock does not run, so it cannot be resampled; "
                            "correct t_s or leave it out")
    count = int(np.floor((time_s[-1] - time_s[0]) * rate_hz + 1e-6)) + 1
    if count > 50_000_000:
        raise AirTouchError(f"{log.source}: {count} samples at {rate_hz:g} Hz; "
                            "correct t_s or ask for a lower rate")
    new_time = time_s[0] + np.arange(count) / rate_hz
    down = rate_hz < 0.98 / period
    columns = {"t_s": np.arange(count) / rate_hz}
    for name, values in log.columns.items():
        if name != "t_s":
            columns[name] = _column(name, time_s, values[rising], new_time, period, rate_hz if down else None)
    low_pass = f"zero-phase Butterworth, {CUTOFF * rate_hz:g} Hz" if down else "none"
    done = {"from_hz": 1.0 / period, "to_hz": rate_hz, "low_pass": low_pass,
            "lost_samples": sum(gap.lost for gap in gaps), "longest_bridge_s": LONGEST_BRIDGE_S}
    note = f"resampled from {1.0 / period:.2f} to {rate_hz:g} Hz"
    return FlightLog(columns, {**log.meta, "resampled": done, "sample_period_s": 1.0 / rate_hz,
                               "warnings": [*log.meta.get("warnings", []), note]})


def _column(name: str, time_s: np.ndarray, values: np.ndarray, new_time: np.ndarray, period: float,
            low_pass_for: float | None) -> np.ndarray:
    """One channel at the new times."""
    valid = np.isfinite(values)
    time_s, values = time_s[valid], values[valid]
    new = np.full(len(new_time), np.nan)
    bridge = max(LONGEST_BRIDGE_S, 1.5 * period)
    bounds = np.r_[0, np.flatnonzero(np.diff(time_s) > bridge) + 1, len(time_s)]
    for start, stop in zip(bounds[:-1], bounds[1:], strict=True):
        if stop == start:
            continue
        t, v = time_s[start:stop], values[start:stop]
        first, last = np.searchsorted(new_time, (t[0] - 1e-9, t[-1] + 1e-9))
        at = new_time[first:last]
        if name in HELD:
            new[first:last] = v[np.maximum(np.searchsorted(t, at + 1e-9, side="right") - 1, 0)]
            continue
        if name in ANGLES:
            v = np.unwrap(v)
        if low_pass_for:
            t, v = _smoothed(t, v, period, low_pass_for)
        new[first:last] = np.interp(at, t, v)
    if name in ANGLES:
        new = np.angle(np.exp(1j * new))
    return np.clip(new, 0, 65535) if name in PWM and low_pass_for else new


def _smoothed(t: np.ndarray, v: np.ndarray, period: float, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Low-passed on an even grid at the old rate; stretches too short to filter stay as they are."""
    grid = t[0] + np.arange(int(np.floor((t[-1] - t[0]) / period + 1e-6)) + 1) * period
    if len(grid) < 4:
        return t, v
    from scipy.signal import butter, sosfiltfilt  # slow to import, and seldom needed

    sos = butter(8, CUTOFF * rate_hz, fs=1.0 / period, output="sos")
    padding = min(len(grid) - 1, int(3.0 / (CUTOFF * rate_hz * period)) + 1)
    return grid, sosfiltfilt(sos, np.interp(grid, t, v), padlen=padding)
