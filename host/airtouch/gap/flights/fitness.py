"""Whether a log can be diagnosed: values that cannot be, columns that it lacks, what no diagnosis of it can tell."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.checks.channel_faults import stuck_intervals
from airtouch.logs.checks.clock import LATEST_S
from airtouch.logs.checks.conventions import wrong_signs, wrong_units
from airtouch.logs.checks.quality import nothing_logged
from airtouch.logs.edges import true_edges
from airtouch.logs.flight_log import ACC, GYRO, PWM, RANGES, FlightLog
from airtouch.logs.in_flight import airborne
from airtouch.logs.segments import PLATFORM_STEP_M

LEAST_AIR_S = 3.0  #: seconds in the air that a flight needs to be diagnosed; chosen
#: magnitude above which a value is none, in any column's unit but for the clock; chosen, beyond what any sensor says
LARGEST = 1e5
PWM_RANGE = (-1.0, 66000.0)  #: of a motor command, which has 16 bits: 0 to 65535; its margins are chosen
IMU = frozenset({*ACC, *GYRO})  #: channels whose standing still is told; a motor may stand at its limit
LEAST_GOOD = 0.5  #: share of a column's values that must be possible, else the column is left out; chosen


def without_bad_columns(log: FlightLog) -> tuple[FlightLog, tuple[str, ...]]:
    """The log without impossible values and columns that hold few others, and notes on what it lacks.

    Raises AirTouchError where nothing was logged, without motor commands or accelerations, for a single sample, and for
    a column in other units than its name says. A rate of the wrong sign is the first note.
    """
    name = log.source
    if nothing_logged(log):
        raise AirTouchError(f"{name}: nothing was logged: every value of every channel is missing (NaN)")
    notes = [str(w) for w in log.meta.get("warnings", []) if "cut off" in str(w)]
    log, unfit = _without_impossible_values(log)
    if unfit:
        notes.append(f"left out, as most of it is missing or out of range: {', '.join(unfit)}")
    for columns, what in ((PWM, "motor commands"), (ACC, "accelerations")):
        if missing := [column for column in columns if not log.has(column)]:
            raise AirTouchError(f"{name}: no {what} ({', '.join(missing)}); log them, the diagnosis "
                                "compares the motor commands with the IMU's measurements")
    if len(log) < 2:
        raise AirTouchError(f"{name}: {len(log)} samples; at least {LEAST_AIR_S:g} s of flight are needed")
    flying = airborne(log)
    if faults := wrong_units(log, flying):
        raise AirTouchError(f"{name}: {'; '.join(faults)}")
    notes += [f"{channel} does not change in {share:.0%} of the flight"
              for channel, share in _stuck_shares(log, flying).items()]
    return log, (*wrong_signs(log, flying), *notes)


def _stuck_shares(log: FlightLog, flying: np.ndarray) -> dict[str, float]:
    """Share of the samples in the air in which a channel of the IMU is stuck, by the channels that ever are.

    flying: (n,) bool.
    """
    out: dict[str, float] = {}
    for channel, start, stop in stuck_intervals(log, flying):
        if channel in IMU:
            out[channel] = out.get(channel, 0.0) + float(flying[start:stop].sum() / max(flying.sum(), 1))
    return out


def _without_impossible_values(log: FlightLog) -> tuple[FlightLog, list[str]]:
    """The log without values that cannot be and without columns that have few others; their names."""
    limits = {**dict.fromkeys(PWM, PWM_RANGE), "t_s": (-LATEST_S, LATEST_S)}
    columns, unfit = {}, []
    for key, values in log.columns.items():
        low, high = limits.get(key, (-LARGEST, LARGEST))
        good = (values >= low) & (values <= high)
        if len(good) and good.mean() < LEAST_GOOD:
            unfit += [key] if key not in RANGES else []
        else:
            columns[key] = np.where(good, values, np.nan)
    return FlightLog(columns, log.meta), unfit


def log_kind(log: FlightLog) -> str:
    """Format of a log, or of the log that it was converted from, up to its first "-": the authors' have several."""
    return str(log.meta.get("origin_format") or log.meta.get("format", "")).split("-")[0]


def logged_hz(log: FlightLog) -> float:
    """Rate, Hz, at which a log that is at 100 Hz now was logged."""
    resampled = log.meta.get("resampled")
    hertz = resampled.get("from_hz") if isinstance(resampled, dict) else None
    return float(hertz) if isinstance(hertz, int | float) and np.isfinite(hertz) else 100.0


def stamped_at_arrival(log: FlightLog) -> bool:
    """Whether the host stamped the rows: the authors' logs, converted ones too."""
    return log_kind(log) == "authors"


def cannot_tell(log: FlightLog) -> tuple[str, ...]:
    """Sentences on what no diagnosis of this log can tell, for want of a channel or of an edge."""
    cannot = []
    if missing := [column for column in GYRO if not log.has(column)]:
        which = "gyro" if len(missing) == len(GYRO) else ", ".join(missing)
        cannot.append(f"no {which}: torque only at low frequency, from the balance of the motors")
    if stamped_at_arrival(log):
        cannot.append("logged times are those of arrival at the host: the drone's own clock cannot be judged")
    if not log.has("zrange_m"):
        cannot.append("no down range: range steps and flow scale cannot be seen; the floor is taken as flat, and the "
                      "height over it comes from z_m" if log.has("z_m") else
                      "no down range: ground effect, range steps and flow scale cannot be seen (z_m would do for the "
                      "first)")
    elif not true_edges(log, PLATFORM_STEP_M):
        cannot.append("no edge crossed: range steps and flow scale cannot be seen")
    if not log.has("vx_mps", "vy_mps"):
        cannot.append("no velocity: drag, flapping and wind cannot be told from a constant push")
    return tuple(cannot)


def notes_of(flights: Sequence[tuple[str, Sequence[str]]], which: str = "flights") -> list[str]:
    """The notes on flights, each once: with the flight's name, or with the number of flights where several have it.

    flights: name and notes of each flight; which: what these flights are, in words.
    """
    having: dict[str, list[str]] = {}
    for name, notes in flights:
        for note in notes:
            having.setdefault(note, []).append(name)
    return [f"{Path(names[0]).name if len(names) == 1 else f'{len(names)} of {len(flights)} {which}'}: {note}"
            for note, names in having.items()]


def cannot_of(flights: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """What logs cannot say, each reason once, with the number of flights where it is not all.

    flights: reasons of each flight.
    """
    count = Counter(reason for one in flights for reason in one)
    return tuple(r if n == len(flights) else f"{n} of {len(flights)} flights: {r}" for r, n in count.items())
