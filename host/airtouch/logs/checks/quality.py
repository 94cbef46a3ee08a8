"""The quality report of a flight: faults of its clock and of its channels."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError, printable
from airtouch.logs.checks.channel_faults import duplicates, saturation_counts, spikes, stuck_intervals
from airtouch.logs.checks.clock import LATEST_S, Gap, lost_samples, sample_period, true_period
from airtouch.logs.checks.conventions import wrong_signs, wrong_units
from airtouch.logs.edges import Edge, true_edges
from airtouch.logs.flight_log import ACC, ATTITUDE, GYRO, POSITION, PWM, RPM, VELOCITY, FlightLog
from airtouch.logs.in_flight import airborne, flies_below_in_words
from airtouch.logs.segments import Segment, segments
from airtouch.parameters import DEFAULT

#: group of channels -> its columns
GROUPS = {"acc": ACC, "gyro": GYRO, "pwm": PWM, "range": ("zrange_m",), "vbat": ("vbat_V",), "position": POSITION,
          "velocity": VELOCITY, "attitude": ATTITUDE, "rpm": RPM}
SHORT_FLIGHT_S = 5.0  #: s in the air; a shorter flight gets a warning


@dataclass(frozen=True)
class Quality:
    """The quality report of a flight. Sample indices count from 0; intervals are (channel, start, stop)."""

    source: str
    format: str
    samples: int
    duration_s: float
    rate_hz: float | None  #: sample rate by the log's clock; None without a usable clock
    gaps: list[Gap]  #: samples that were lost
    clock_repeats: int  #: steps of the clock that are zero
    clock_backwards: int  #: steps of the clock that are negative
    missing: dict[str, int]  #: channel -> samples that are NaN or infinite
    duplicated: list[tuple[str, str]]  #: pairs of channels that are equal up to scale and offset
    stuck: list[tuple[str, int, int]]  #: intervals in which a channel does not change in flight
    saturated: dict[str, int]  #: channel -> samples at full scale
    spikes: dict[str, list[int]]  #: channel -> isolated samples far from both neighbours
    segments: list[Segment]
    edges: list[Edge]
    warnings: list[str]  #: one line for each fault, the reader's warnings first

    @property
    def lost(self) -> int:
        """Samples lost in all gaps."""
        return sum(gap.lost for gap in self.gaps)

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self) | {"lost": self.lost}


def summary(log: FlightLog, arm_pwm: float = DEFAULT.arm_pwm) -> dict[str, Any]:
    """One flight in a row of plain data: format, length, rate, groups of channels, true edges, warnings.

    arm_pwm: as of `check`.
    """
    report = check(log, arm_pwm)
    return {
        "source": log.source, "format": report.format, "samples": report.samples,
        "duration_s": report.duration_s, "rate_hz": report.rate_hz,
        "channels": [name for name, columns in GROUPS.items() if any(map(log.has, columns))],
        "entries": sum(edge.kind == "entry" for edge in report.edges),
        "exits": sum(edge.kind == "exit" for edge in report.edges),
        "condition": printable(str(log.meta.get("condition", ""))), "warnings": len(report.warnings),
    }


def check(log: FlightLog, arm_pwm: float = DEFAULT.arm_pwm) -> Quality:
    """The quality report of a flight log. A bad log gives warnings, never an exception. The log is not changed.

    arm_pwm: mean PWM above which the vehicle flies.
    """
    clock, steps = log["t_s"] if log.has("t_s") else np.empty(0), clock_steps(log)
    period = true_period(clock)
    flying, phases, edges = _flight(log, arm_pwm)
    missing = {name: int((~np.isfinite(v)).sum()) for name, v in log.columns.items()}
    quality = Quality(
        source=log.source, format=str(log.meta.get("format", "")), samples=len(log),
        duration_s=_duration(clock, len(log), sample_period(log)), rate_hz=1.0 / period if period else None,
        gaps=lost_samples(clock, period) if period else [],
        clock_repeats=int((steps == 0).sum()), clock_backwards=int((steps < 0).sum()),
        missing={name: count for name, count in missing.items() if count},
        duplicated=duplicates(log), stuck=stuck_intervals(log, flying), saturated=saturation_counts(log),
        spikes=spikes(log), segments=phases, edges=edges, warnings=[str(w) for w in log.meta.get("warnings", [])])
    return replace(quality, warnings=quality.warnings + _faults_in_words(log, quality, flying, arm_pwm))


def clock_steps(log: FlightLog) -> np.ndarray:
    """Differences of the logged times, (n - 1,) s; empty for a log without times."""
    with np.errstate(invalid="ignore", over="ignore"):
        return np.diff(log["t_s"]) if log.has("t_s") else np.empty(0)


def nothing_logged(log: FlightLog) -> bool:
    """True if every value of every channel except the time is missing."""
    return len(log) > 0 and not any(np.isfinite(v).any() for name, v in log.columns.items() if name != "t_s")


def _flight(log: FlightLog, arm_pwm: float) -> tuple[np.ndarray, list[Segment], list[Edge]]:
    """Airborne samples (n,) bool, phases and edges. A log without motors and height has none of them."""
    try:
        flying = airborne(log, arm_pwm)
        edges = true_edges(log, arm_pwm=arm_pwm) if log.has("zrange_m") else []
        return flying, segments(log, arm_pwm), edges
    except AirTouchError:
        return np.ones(len(log), dtype=bool), [], []


def _duration(clock: np.ndarray, samples: int, period: float) -> float:
    """Seconds from the first possible time to the last; by the number of samples without any."""
    timed = clock[np.abs(clock) <= LATEST_S]
    return float(timed[-1] - timed[0]) if len(timed) else max(samples - 1, 0) * period


def _faults_in_words(log: FlightLog, quality: Quality, flying: np.ndarray, arm_pwm: float) -> list[str]:
    """One line for each fault of the log. flying: samples in the air, (n,) bool."""
    if nothing_logged(log):
        return ["nothing was logged: every value of every channel is missing"]
    words = [*wrong_units(log, flying), *wrong_signs(log, flying)]
    if quality.gaps:
        longest = max(gap.seconds for gap in quality.gaps)
        words.append(f"{quality.lost} samples lost in {len(quality.gaps)} gaps, the longest {longest:.2f} s")
    if quality.clock_repeats:
        words.append(f"the clock stands still {quality.clock_repeats} times")
    if quality.clock_backwards:
        words.append(f"the clock runs backwards {quality.clock_backwards} times")
    if log.has("t_s") and quality.rate_hz is None and len(log) > 1:
        words.append("the clock does not run, or not in seconds")
    for name, count in quality.missing.items():
        words.append(f"{name}: {count} of {len(log)} samples missing")
    words += [f"{b} repeats {a}" for a, b in quality.duplicated]
    for name, start, stop in quality.stuck:
        whole = stop - start == len(log)
        place = f"{name} is stuck from sample {start} to {stop}"
        words.append(f"{name} never changes" if whole else place)
    for name, count in quality.saturated.items():
        words.append(f"{name}: {count} samples at the end of its scale")
    for name, at in quality.spikes.items():
        words.append(f"{name}: {len(at)} isolated spikes, first at sample {at[0]}")
    words += flies_below_in_words(log, arm_pwm)
    in_air = sum(phase.stop - phase.start for phase in quality.segments if phase.kind != "ground") * sample_period(log)
    if not in_air:
        words.append("no flight in it, or no motors and height to tell")
    elif in_air < SHORT_FLIGHT_S:
        words.append(f"in the air for only {in_air:.1f} s")
    return words
