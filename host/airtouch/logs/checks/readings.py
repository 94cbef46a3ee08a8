"""Limits of values and times. Every log that is read from a file passes `without_impossible_values` once."""

from typing import Any

import numpy as np

from airtouch.errors import AirTouchError, printable
from airtouch.logs.checks.clock import FASTEST_S, LATEST_S, SLOWEST_S, true_period
from airtouch.logs.flight_log import FlightLog

MOST_CONTRADICTION = 0.05  #: of the stated sample period, largest difference from the clock's without a warning; chosen
LARGEST = float(np.finfo(np.float32).max)  #: the firmware's variables are float32 or smaller


def without_impossible_values(log: FlightLog) -> FlightLog:
    """The log with impossible values as NaN and without impossible metadata, with a warning for each kind.

    Every value is then NaN or within float32, and n samples span less than n times 5 s. So time and
    memory of any later step are bounded by the size of the log. Raises AirTouchError for a clock that
    is not in seconds, or that is mostly impossible.
    """
    meta, warnings = _possible_meta(log.meta)
    columns = {}
    for name, values in log.columns.items():
        with np.errstate(invalid="ignore"):
            bad = np.abs(values) > LARGEST
        columns[name] = _without(values, bad, f"{name}: no sensor reads", warnings)
    if "t_s" in columns:
        columns["t_s"] = _without(columns["t_s"], _impossible_times(columns["t_s"], log.source),
                                  "t_s: not of this flight", warnings)
        _compare_periods(columns["t_s"], meta, warnings)
    return FlightLog(columns, meta | {"warnings": warnings})


def _without(values: np.ndarray, bad: np.ndarray, problem: str, warnings: list[str]) -> np.ndarray:
    """The values with NaN where `bad`, (n,) both; adds a warning with their number."""
    where = np.flatnonzero(bad)
    if not len(where):
        return values
    warnings.append(f"{problem} {values[where[0]]:g} (sample {where[0]}); {len(where)} of {len(values)} values "
                    "were taken as missing")
    return np.where(bad, np.nan, values)


def stated_period_fits(stated: Any, time_s: np.ndarray) -> bool:
    """Whether a stated sample period, s, is that of the clock (n,) s, by its median step or its median slope.

    Lost samples change the slope alone, and packets that come in bursts the step alone. True for a clock that does
    not run, and for what is no number.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        periods = [p for p in (_step(time_s[np.isfinite(time_s)]), true_period(time_s)) if p]
    if isinstance(stated, bool) or not isinstance(stated, (int, float)) or not stated or not periods:
        return True
    return any(abs(period / stated - 1.0) <= MOST_CONTRADICTION for period in periods)


def _impossible_times(time_s: np.ndarray, source: str) -> np.ndarray:
    """True for times outside the interval of n times 5 s that holds the most times, (n,) bool."""
    with np.errstate(invalid="ignore"):
        wrong = np.abs(time_s) > LATEST_S
    there = ~np.isnan(time_s)
    possible = time_s[there & ~wrong]
    if not len(possible):
        return wrong
    first = np.sort(possible)
    last = first + SLOWEST_S * len(time_s)
    most = np.argmax(np.searchsorted(first, last, side="right") - np.arange(len(first)))
    wrong |= (time_s < first[most]) | (time_s > last[most])
    if wrong.sum() > 0.5 * len(time_s) or _step(time_s[there & ~wrong]) > SLOWEST_S:
        raise AirTouchError(f"{source}: {_step(possible):g} s from sample to sample, and {wrong.sum()} of "
                            f"{len(time_s)} times cannot be; give t_s in seconds, correct it or leave it out")
    return wrong


def _compare_periods(time_s: np.ndarray, meta: dict[str, Any], warnings: list[str]) -> None:
    """Add a warning where the stated sample period is not that of the clock (n,) s."""
    stated, logged = meta.get("sample_period_s"), true_period(time_s)
    if stated is None or logged is None or abs(logged / stated - 1.0) <= MOST_CONTRADICTION:
        return
    note = (f"sample_period_s is {stated:g} s, but t_s rises by {logged:.4g} s a sample: correct it or leave it out, "
            "unless many samples are lost")
    if note not in warnings:  # of the file that this one was converted from
        warnings.append(note)


def _step(time_s: np.ndarray) -> float:
    """Median of the clock's forward steps in seconds; 0 without any."""
    steps = np.diff(time_s)
    return float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0


def _possible_meta(meta: dict[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """The metadata without known keys of a wrong type or value, and all warnings so far."""
    meta, warnings = dict(meta), list(meta["warnings"])
    period = meta.get("sample_period_s", 0.01)
    if isinstance(period, bool) or not isinstance(period, (int, float)) or not FASTEST_S <= period <= SLOWEST_S:
        warnings.append(f"sample_period_s: {printable(str(period))} is not {FASTEST_S:g} to {SLOWEST_S:g} s; left out")
        del meta["sample_period_s"]
    if meta.get("acc_frame", "body") not in ("body", "world"):
        warnings.append(f"acc_frame: {printable(str(meta['acc_frame']))} is neither body nor world; taken as body")
        meta["acc_frame"] = "body"
    return meta, warnings
