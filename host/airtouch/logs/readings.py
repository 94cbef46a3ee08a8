"""What a reading and a clock may be. Every log that was read from a file passes here once."""

from typing import Any

import numpy as np

from airtouch.errors import AirTouchError, shown
from airtouch.logs.clock import FASTEST_S, LATEST_S, SLOWEST_S
from airtouch.logs.flight_log import FlightLog

LARGEST = float(np.finfo(np.float32).max)  #: the firmware's variables are float32 or smaller


def checked(log: FlightLog) -> FlightLog:
    """The log with values that cannot be as NaN and metadata that cannot be left out, each with a warning.

    After it every value is NaN or within float32, and every time is NaN or within reach of the
    others: n samples make less than n times 5 s. So what works on a log needs neither time nor
    memory beyond its size. Raises AirTouchError where the clock is not in seconds, or most of it
    cannot be.
    """
    meta, warnings = _checked_meta(log.meta)
    columns = {}
    for name, values in log.columns.items():
        with np.errstate(invalid="ignore"):
            bad = np.abs(values) > LARGEST
        columns[name] = _without(values, bad, f"{name}: no sensor reads", warnings)
    if "t_s" in columns:
        columns["t_s"] = _without(columns["t_s"], _impossible_times(columns["t_s"], log.source),
                                  "t_s: not of this flight", warnings)
    return FlightLog(columns, meta | {"warnings": warnings})


def _without(values: np.ndarray, bad: np.ndarray, problem: str, warnings: list[str]) -> np.ndarray:
    """The values with the bad ones as NaN, and a warning that counts them."""
    where = np.flatnonzero(bad)
    if not len(where):
        return values
    warnings.append(f"{problem} {values[where[0]]:g} (sample {where[0]}); {len(where)} of {len(values)} values "
                    "were taken as missing")
    return np.where(bad, np.nan, values)


def _impossible_times(time_s: np.ndarray, source: str) -> np.ndarray:
    """Times too far from the log's median time for its number of samples, bool (n,)."""
    with np.errstate(invalid="ignore"):
        late = np.abs(time_s) > LATEST_S
    possible = time_s[~late & ~np.isnan(time_s)]
    if not len(possible):
        return late
    steps = np.diff(possible)
    step = np.median(steps[steps > 0]) if (steps > 0).any() else FASTEST_S
    if step > SLOWEST_S:
        raise AirTouchError(f"{source}: {step:g} s between its samples, where {SLOWEST_S:g} s is the most; "
                            "give t_s in seconds")
    with np.errstate(invalid="ignore"):
        far = late | (np.abs(time_s - np.median(possible)) > 0.5 * SLOWEST_S * len(time_s))
    if far.sum() > 0.5 * len(time_s):
        first = np.flatnonzero(far)[0]
        raise AirTouchError(f"{source}: {far.sum()} of {len(time_s)} times cannot be, the first "
                            f"{time_s[first]:g} s (sample {first}); correct t_s or leave it out")
    return far


def _checked_meta(meta: dict[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """Metadata whose known keys hold what their readers expect, and the warnings so far."""
    meta, warnings = dict(meta), list(meta["warnings"])
    period = meta.get("sample_period_s", 0.01)
    if isinstance(period, bool) or not isinstance(period, (int, float)) or not FASTEST_S <= period <= SLOWEST_S:
        warnings.append(f"sample_period_s: {shown(str(period))} is not {FASTEST_S:g} to {SLOWEST_S:g} s; left out")
        del meta["sample_period_s"]
    if meta.get("acc_frame", "body") not in ("body", "world"):
        warnings.append(f"acc_frame: {shown(str(meta['acc_frame']))} is neither body nor world; taken as body")
        meta["acc_frame"] = "body"
    return meta, warnings
