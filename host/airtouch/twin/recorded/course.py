"""The course of a flight, from its log alone: heights, times, speed, phases.

A course is the input with which the simulator repeats the flight: hover, a velocity step, a platform,
a stop. The platform follows from the steps of the down range.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from scipy.ndimage import median_filter

from airtouch.detector.shared.channels import level_acceleration
from airtouch.errors import AirTouchError
from airtouch.logs.checks.clock import sample_period
from airtouch.logs.edges import Edge, true_edges
from airtouch.logs.flight_log import ACC, GYRO, PWM, VELOCITY, FlightLog
from airtouch.logs.in_flight import airborne
from airtouch.logs.segments import LEVEL_PART, PLATFORM_STEP_M
from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.twin.recorded import pulses

MIN_FREE_S = 3.0  #: s, least free air before the platform: a block of the spectra (`features.LENGTH`)
MIN_FREE_M = 0.25  #: m, down range above which there is no ground effect: five rotor diameters
SETTLED_S = 1.0  #: s after the climb until level flight counts as free air; no source: round number
STEP_S = 1.5  #: s, longest duration of a velocity step; no source: round number
#: s from a velocity step to half of its speed, Crazyflie with the firmware's gains; no other source
RISE_S = 0.35
RATE_TOLERANCE = 0.02  #: relative difference from SAMPLE_RATE_HZ that a log may have; no source: round number
#: Samples in which readings are taken, at 100 Hz; no source: round numbers, clear of the one reading that mixes both
#: distances (host/docs/twin-findings.md).
MEDIAN_ROWS = 5  #: of the median filter on the down range, against single wrong readings
CRUISE, BEFORE = slice(-150, -3), slice(-30, -4)  #: relative to the entry: level height, height just before it
OVER = slice(20, -10)  #: relative to entry and exit: over the platform, past the answers to the edges
CLEARANCE_STOP = -3  #: relative to the exit: end of the readings over the platform
CLEARANCE_PART = 0.3  #: fraction of a short pass that is skipped at its beginning, at most OVER.start
LANDING = 10  #: after the exit: where the search for the landing begins
SPEED = slice(-50, -5)  #: relative to the entry: speed of the cruise
#: phases of a course, in order
PHASES = ("hover", "cruise", "entry", "over", "exit", "after")
AROUND_S = (0.5, 1.0)  #: s before and after an edge that belong to the edge's phase; no source: round numbers


@dataclass(frozen=True)
class Course:
    """One flight. Times in s, heights in m as the down range shows them, samples of the log.

    Names and order of the fields are part of `fit.key`: a change makes stored fits those of other flights.

    cruise_m: level height before the platform. clearance_m: median height over the platform. before_m, entered_m: just
    before and just after the entry. climb_s: from the motors' start to level flight; hover_s: to the velocity step;
    before_s: to the entry; over_s: to the exit; stop_s: to the end of the forward flight; after_s: from the exit to
    the landing. speed_mps: of the velocity step; speed_from: "stated",
    "velocity" or "acceleration". angle_deg: between path and the edge's normal, as stated. pulse_s: period of
    velocity pulses in the hover, 0: none. top_m: height of the platform where other flights show it (`near_range`), 0:
    not known. start: the motors' start; level: start of level flight; step: the velocity step.
    """

    source: str
    cruise_m: float
    clearance_m: float
    before_m: float
    entered_m: float
    climb_s: float
    hover_s: float
    before_s: float
    over_s: float
    stop_s: float
    after_s: float
    speed_mps: float
    speed_from: str
    angle_deg: float
    start: int
    level: int
    step: int
    entry: int
    exit: int
    landing: int
    pulse_s: float = 0.0
    top_m: float = 0.0

    def as_dict(self) -> dict[str, float | int | str]:
        """The fields as plain values, for files."""
        return asdict(self)

    def phases(self) -> dict[str, slice]:
        """Phase of PHASES -> samples."""
        before, behind = (int(s * SAMPLE_RATE_HZ) for s in AROUND_S)
        settled = int(SETTLED_S * SAMPLE_RATE_HZ)
        step = max(min(self.step, self.entry - before), self.level + settled)
        spans = {"hover": (self.level + settled, step),
                 "cruise": (step, self.entry - before),
                 "entry": (self.entry - before, min(self.entry + behind, self.exit)),
                 "over": (self.entry + OVER.start, self.exit + OVER.stop),
                 "exit": (self.exit - before, min(self.exit + behind, self.landing)),
                 "after": (self.exit + behind, self.landing)}
        return {name: slice(a, max(a, b)) for name, (a, b) in spans.items()}

    @property
    def free(self) -> slice:
        """Samples of level flight in free air before the platform."""
        return slice(self.level + int(SETTLED_S * SAMPLE_RATE_HZ), self.entry - int(AROUND_S[0] * SAMPLE_RATE_HZ))


def course(log: FlightLog, speed_mps: float | None = None, angle_deg: float | None = None) -> Course:
    """The course of a flight over one platform, the first one.

    speed_mps, angle_deg: from a manifest, if it states them. Raises AirTouchError, with what to fly, for a log
    without down range, platform or free air.
    """
    check(log)
    edges = platform_edges(log)
    down = median_filter(_interpolate(log["zrange_m"]), MEDIAN_ROWS)
    flying = airborne(log)
    entry = next((e for e in edges if e.kind == "entry"), None)
    leave = next((e for e in edges if entry and e.kind == "exit" and e.sample > entry.sample), None)
    if entry is None or leave is None:
        raise AirTouchError(f"{log.source}: no platform in its down range; fly straight over a table's or a "
                            "box's two edges, at least 12 cm higher than the floor")
    start = _last_start(flying, entry.sample)
    last = len(log) if flying[leave.sample:].all() else leave.sample + int(np.argmin(flying[leave.sample:]))
    cruise = float(np.median(down[max(entry.sample + CRUISE.start, start):entry.sample + CRUISE.stop]))
    level = start + int(np.argmax(down[start:entry.sample] > LEVEL_PART * cruise))
    free_s = (entry.sample - level) / SAMPLE_RATE_HZ - SETTLED_S - AROUND_S[0]
    if free_s < MIN_FREE_S or cruise < MIN_FREE_M:
        raise AirTouchError(f"{log.source}: {max(free_s, 0.0):.1f} s of level flight in free air before the "
                            f"platform; hover {MIN_FREE_S + 2:g} s at {MIN_FREE_M:g} m or higher first")
    low = down[leave.sample + LANDING:last] < LEVEL_PART * cruise
    landing = leave.sample + LANDING + (int(np.argmax(low)) if low.any() else len(low))
    step, measured, source = _velocity_step(log, level, entry.sample)
    stop = _stop(log, step, leave.sample, landing)
    speed = speed_mps if speed_mps is not None else measured
    over = (leave.sample - entry.sample) / SAMPLE_RATE_HZ
    skipped = min(OVER.start, int(CLEARANCE_PART * SAMPLE_RATE_HZ * over))
    clearance = float(np.median(down[entry.sample + skipped:leave.sample + CLEARANCE_STOP]))
    before = float(np.median(down[max(entry.sample + BEFORE.start, level):entry.sample + BEFORE.stop]))
    return Course(log.source, cruise, clearance, before, entry.height_after_m, (level - start) / SAMPLE_RATE_HZ,
                  (step - level) / SAMPLE_RATE_HZ, (entry.sample - step) / SAMPLE_RATE_HZ, over,
                  (stop - leave.sample) / SAMPLE_RATE_HZ, (landing - leave.sample) / SAMPLE_RATE_HZ, speed,
                  "stated" if speed_mps is not None else source, angle_deg or 0.0, start, level, step,
                  entry.sample, leave.sample, landing, pulses.period(log, level, step))


def platform_edges(log: FlightLog) -> list[Edge]:
    """True edges of a log; without any, the edges of platforms of at least 12 cm."""
    return true_edges(log) or true_edges(log, PLATFORM_STEP_M)


def check(log: FlightLog) -> None:
    """Raise AirTouchError, in one line with the remedy, for a log that cannot be used to fit a twin."""
    log.require(*ACC, *GYRO, *PWM)
    if not log.has("zrange_m") or not np.isfinite(log["zrange_m"]).any():
        raise AirTouchError(f"{log.source}: no down range in this log; log range.zrange (flow deck or Z-ranger) too")
    period = sample_period(log)
    if abs(period - 1.0 / SAMPLE_RATE_HZ) > RATE_TOLERANCE / SAMPLE_RATE_HZ:
        raise AirTouchError(f"{log.source}: logged at {1 / period:.4g} Hz, a twin needs 100 Hz: "
                            "airtouch logs convert --rate 100")


def one_vehicle(logs: Sequence[FlightLog]) -> str:
    """The vehicle of all the logs; "" if none names one. Raises AirTouchError for two different ones."""
    names = {str(log.meta["vehicle"]): log.source for log in logs if log.meta.get("vehicle")}
    if len(names) > 1:
        pairs = [f"{name} flew {source}" for name, source in list(names.items())[:2]]
        raise AirTouchError(f"two vehicles: {', '.join(pairs)}; fit one twin for each")
    return next(iter(names), "")


def _last_start(flying: np.ndarray, entry: int) -> int:
    """Sample of the last take-off before an entry."""
    grounded = np.flatnonzero(~flying[:entry])
    return int(grounded[-1]) + 1 if len(grounded) else 0


def _interpolate(values: np.ndarray) -> np.ndarray:
    """Values (n,) with straight lines over the gaps."""
    finite = np.isfinite(values)
    return np.interp(np.arange(len(values)), np.flatnonzero(finite), values[finite])


def _velocity_step(log: FlightLog, level: int, entry: int) -> tuple[int, float, str]:
    """Sample of the forward velocity step before an entry, its speed in m/s, and the source of the speed.

    The source is the logged velocity, or without one the horizontal acceleration, less its mean in level
    flight, integrated over STEP_S; accurate to about 0.07 m/s.
    """
    settled = min(level + int(SETTLED_S * SAMPLE_RATE_HZ), entry + SPEED.start)
    if log.has(*VELOCITY[:2]):
        speed = _speed(log)
        final = float(np.median(speed[max(entry + SPEED.start, settled):entry + SPEED.stop]))
        slow = np.flatnonzero(speed[settled:entry] < 0.5 * final)
        half = settled + (int(slow[-1]) if len(slow) else 0)
        return max(half - int(RISE_S * SAMPLE_RATE_HZ), settled), final, "velocity"
    gain = _gain(_horizontal(log, settled, entry))
    first = int(np.argmax(np.hypot(*gain.T)))
    final = float(np.hypot(*gain[first]))
    total = np.hypot(*np.cumsum(_horizontal(log, settled, entry)[first:], axis=0).T) / SAMPLE_RATE_HZ
    half = first + int(np.argmax(total > 0.5 * final))
    return max(settled + half - int(RISE_S * SAMPLE_RATE_HZ), settled), final, "acceleration"


def _stop(log: FlightLog, step: int, leave: int, landing: int) -> int:
    """Sample after an exit at which the forward flight ends: that of the largest loss of speed."""
    if landing - leave < int(STEP_S * SAMPLE_RATE_HZ):
        return landing
    if log.has(*VELOCITY[:2]):
        speed = _speed(log)
        fast = np.flatnonzero(speed[leave:landing] > 0.5 * np.median(speed[step:leave]))
        half = leave + (int(fast[-1]) if len(fast) else 0)
    else:
        forward = _gain(_horizontal(log, step, leave))[0]
        along = _gain(_horizontal(log, leave, landing)) @ (forward / max(np.hypot(*forward), 1e-9))
        half = leave + int(np.argmin(along)) + int(RISE_S * SAMPLE_RATE_HZ)
    return min(max(half - int(RISE_S * SAMPLE_RATE_HZ), leave), landing)


def _speed(log: FlightLog) -> np.ndarray:
    """Horizontal speed (n,), m/s, from the logged velocity."""
    return np.hypot(*(np.nan_to_num(log[c]) for c in VELOCITY[:2]))


def _gain(acc: np.ndarray) -> np.ndarray:
    """Gain of speed over STEP_S (or half of the interval) from each sample on, (m, 2) m/s, of acc (n, 2)."""
    n = max(min(int(STEP_S * SAMPLE_RATE_HZ), len(acc) // 2), 1)
    total = np.vstack([np.zeros(2), np.cumsum(acc, axis=0)]) / SAMPLE_RATE_HZ
    return total[n:] - total[:-n]


def _horizontal(log: FlightLog, start: int, stop: int) -> np.ndarray:
    """Horizontal specific force of samples start to stop - 1 less its median, (n, 2) m/s^2, with gaps filled."""
    acc = level_acceleration(log)[start:stop, :2]
    acc = np.column_stack([_interpolate(a) for a in acc.T])
    return acc - np.median(acc, axis=0)
