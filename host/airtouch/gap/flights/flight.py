"""A flight made ready for the diagnosis: a regular clock, what effects see, what was measured."""

from collections.abc import Container
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.flights import motion
from airtouch.gap.workspace import Workspace
from airtouch.logs.checks.clock import LEAST_AFTER, lost_samples, true_period
from airtouch.logs.checks.quality import nothing_logged
from airtouch.logs.edges import true_edges
from airtouch.logs.flight_log import ACC, ATTITUDE, GYRO, PWM, RANGES, FlightLog
from airtouch.logs.resample import resample
from airtouch.logs.segments import KINDS, PLATFORM_STEP_M, segments
from airtouch.robust import deviation
from airtouch.simulation import replay
from airtouch.simulation import signals as at
from airtouch.simulation.body.rotation import as_matrix
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

PERIOD_S = 0.01
GROUND = KINDS.index("ground")
LEAST_AIR_S = 3.0  #: less time in the air than this is not diagnosed
LARGEST = 1e5  #: no column holds more
LEAST_GOOD = 0.5  #: part of a column's values that must be there
SETTLED_S = 1.0  #: s after the motors have stopped in which the vehicle may still bounce
KNOCK = 7.0  #: standard deviations (of the median kind) on the ground from which a sample is a knock
CONTACT_S = 0.3  #: s, excluded around the moments at which the vehicle touches the ground
JOLT = 40.0  #: standard deviations in flight above which it hit something (steps of a set-point reach 35)
MOST_JOLTED = 0.1  #: share of a flight; more is no accident
TOUCH_M, TOUCH_S = 0.006, 0.05  #: height above standing below which legs may touch in flight; how long that rings


@dataclass(frozen=True)
class Flight:
    """One flight on a regular 10 ms clock.

    signals (n, COUNT) for effects; acceleration (n, 3) m/s^2: specific force, body axes;
    rates (n, 3) rad/s or None; pwm (n, 4); turn (n, 3, 3) body to world; phase (n,) places
    in `segments.KINDS`; usable (n,): neither lost nor close to touching the ground;
    clock_s (m,): logged times of the rows that arrived minus the regular ones, as far as those are sure;
    lost (n,): rows that did not arrive; touching (n,): in flight, so low that the legs may touch.
    """

    name: str
    log: FlightLog
    signals: np.ndarray
    acceleration: np.ndarray
    rates: np.ndarray | None
    pwm: np.ndarray
    turn: np.ndarray
    phase: np.ndarray
    usable: np.ndarray
    clock_s: np.ndarray
    lost: np.ndarray
    touching: np.ndarray
    notes: tuple[str, ...] = ()
    cannot: tuple[str, ...] = ()
    workspace: Workspace = field(default_factory=Workspace, init=False, compare=False, repr=False)

    def __len__(self) -> int:
        return len(self.pwm)

    @property
    def bridged(self) -> np.ndarray:
        """Samples whose gap is nobody's, bool (n,): the log lost them, or the floor held the legs."""
        return self.lost | self.touching

    @property
    def on_ground(self) -> np.ndarray:
        """Whether the vehicle stands with its motors off, bool (n,)."""
        return (self.phase == GROUND) & (self.pwm.max(axis=1) <= 0.0)


def ready(log: FlightLog, vehicle: Vehicle) -> Flight:
    """Make a log ready.

    Raises AirTouchError, with the file and the remedy, without motor commands or
    accelerations, when the clock runs backwards, and when there is no flight in it.
    """
    name, notes = log.source, []
    if nothing_logged(log):
        raise AirTouchError(f"{name}: nothing was logged: every value of every channel is missing (NaN)")
    notes += [f"{Path(name).name}: {w}" for w in log.meta.get("warnings", []) if "cut off" in str(w)]
    log, unfit = _sane(log)
    if unfit:
        notes.append(f"left out, as most of it is missing or out of range: {', '.join(unfit)}")
    for columns, what in ((PWM, "motor commands"), (ACC, "accelerations")):
        if not log.has(*columns):
            raise AirTouchError(f"{name}: no {what} ({', '.join(columns)}); log them, the diagnosis "
                                "compares what the motors were told with what the IMU felt")
    log = _at_100_hz(log, name)
    log, clock, lost = _regular(log, name)
    if _stamped_at_arrival(log):
        clock = np.zeros_like(clock)
    cannot = _cannot(log)
    angles = motion.attitude(log, PERIOD_S)
    turn = as_matrix(*angles.T)
    force = _body_force(log, turn, vehicle.gravity_mps2)
    phase = _phases(log)
    pwm = motion.held(log.stack(PWM))
    if (phase != GROUND).sum() * PERIOD_S < LEAST_AIR_S:
        raise AirTouchError(f"{name}: no flight in it ({(phase != GROUND).sum() * PERIOD_S:.1f} s in the air); "
                            f"at least {LEAST_AIR_S:g} s are needed")
    signals, touching = _signals(log, angles, turn, phase, vehicle)
    rates = motion.held(log.stack(GYRO)) if log.has(*GYRO) else None
    usable = ~lost & ~_near_contact(phase, pwm) & ~_knocks(force, (phase == GROUND) & (pwm.max(axis=1) <= 0.0))
    usable &= ~_jolts(force, rates, phase != GROUND)
    return Flight(name, log, signals, force, rates, pwm, turn, phase, usable, clock, lost,
                  touching, tuple(notes), cannot)


def less(flight: Flight, vehicle: Vehicle, columns: Container[str]) -> Flight:
    """The flight as it would be made ready from a log without some columns, which are neither commands nor motion."""
    log = FlightLog({k: v for k, v in flight.log.columns.items() if k not in columns}, flight.log.meta)
    if len(log.columns) == len(flight.log.columns):
        return flight
    angles = motion.attitude(log, PERIOD_S)
    return replace(flight, log=log, signals=_signals(log, angles, flight.turn, flight.phase, vehicle)[0])


def _stamped_at_arrival(log: FlightLog) -> bool:
    """Whether the host stamped the rows: the authors' logs."""
    return str(log.meta.get("format", "")).startswith("authors")


def _cannot(log: FlightLog) -> tuple[str, ...]:
    """Sentences on what no diagnosis of this log can tell, for want of a channel or of an edge."""
    cannot = []
    if not log.has(*GYRO):
        cannot.append("no gyro: torque only at low frequency, from the balance of the motors")
    if _stamped_at_arrival(log):
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


def _body_force(log: FlightLog, turn: np.ndarray, gravity: float) -> np.ndarray:
    """Specific force (n, 3) m/s^2 in body axes. turn: (n, 3, 3) body to world; gravity: m/s^2.

    Of logs in world axes, some have gravity already subtracted: it is added again.
    """
    force = motion.held(log.stack(ACC))
    if log.meta.get("acc_frame") == "world":
        force = np.einsum("nji,nj->ni", turn, force)
        if np.median(force[:, 2]) < 0.5 * gravity:
            force += np.einsum("nji,j->ni", turn, [0.0, 0.0, gravity])
    return force


def _phases(log: FlightLog) -> np.ndarray:
    """Phase of each sample, int8 (n,): places in `segments.KINDS`."""
    phase = np.zeros(len(log), np.int8)
    for part in segments(log):
        phase[part.start:part.stop] = KINDS.index(part.kind)
    return phase


def _signals(log: FlightLog, angles: np.ndarray, turn: np.ndarray, phase: np.ndarray, vehicle: Vehicle,
             ) -> tuple[np.ndarray, np.ndarray]:
    """Signals (n, COUNT) for effects, and `Flight.touching`. angles: (n, 3) rad, as the columns of ATTITUDE."""
    known = log.with_columns(dict(zip(ATTITUDE, angles.T, strict=True)))
    signals = replay.signals_of(FlightLog({k: motion.held(v) for k, v in known.columns.items()}, known.meta),
                                vehicle, (), PERIOD_S)
    row = prepare(vehicle, ())[0][0]
    standing = row["range_below_rotors"] + row["leg_below_range"]  # height of the rotors
    heights = motion.rotor_heights(log, turn, row["rotor_x"], row["rotor_y"], row["range_below_rotors"],
                                   standing, phase == GROUND, PERIOD_S)
    touching = np.zeros(len(log), bool)
    if heights is None:
        return signals, touching
    signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4] = heights
    signals[:, at.UPPER_HEIGHT:at.UPPER_HEIGHT + 4] = heights
    if not log.has("zrange_m"):
        low = (phase != GROUND) & (heights.mean(axis=1) < standing + TOUCH_M)
        touching = np.convolve(low, np.ones(2 * int(TOUCH_S / PERIOD_S) + 1), "same") > 0.5
    return signals, touching


def _sane(log: FlightLog) -> tuple[FlightLog, list[str]]:
    """The log without values that cannot be and without columns that have few others; their names."""
    columns, unfit = {}, []
    for key, values in log.columns.items():
        low, high = (-1.0, 66000.0) if key in PWM else (-LARGEST, LARGEST)
        good = (values >= low) & (values <= high)
        if len(good) and good.mean() < LEAST_GOOD:
            unfit += [key] if key not in RANGES else []
        else:
            columns[key] = np.where(good, values, np.nan)
    return FlightLog(columns, log.meta), unfit


def _at_100_hz(log: FlightLog, name: str) -> FlightLog:
    if len(log) < 2:
        raise AirTouchError(f"{name}: {len(log)} samples; at least {LEAST_AIR_S:g} s of flight are needed")
    if log.has("t_s"):
        backwards = np.flatnonzero(np.diff(log["t_s"]) < -0.05)
        if len(backwards):
            raise AirTouchError(f"{name}, sample {backwards[0] + 1}: the clock runs backwards by "
                                f"{-np.diff(log['t_s'])[backwards[0]]:.3f} s; cut the log there")
        period = true_period(log["t_s"])
        if period is not None and period < 0.006:
            return resample(log, 100.0)
    return log


def _regular(log: FlightLog, name: str) -> tuple[FlightLog, np.ndarray, np.ndarray]:
    """The log with lost rows put back as NaN, the clock's wandering and which rows were lost."""
    n = len(log)
    if not log.has("t_s"):
        return log, np.zeros(n), np.zeros(n, bool)
    time = motion.held(log["t_s"])
    period = _period(time)
    place = np.arange(n)
    for gap in lost_samples(time, period):
        place[gap.sample:] += gap.lost
    if place[-1] > 3 * n + 1000:
        raise AirTouchError(f"{name}: {place[-1] - n} of {place[-1]} samples are missing; check the clock column")
    known = n - _unsure(time, period)
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


def _unsure(time: np.ndarray, period: float) -> int:
    """Rows at the end after which too few follow to say whether rows before them were lost or these came late."""
    steps = np.flatnonzero(np.diff(time[-LEAST_AFTER - 1:]) > 1.5 * period)
    return min(len(time), LEAST_AFTER) - int(steps[0]) if len(steps) else 0


def _knocks(force: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Samples on the ground at which somebody or something pushed: far off all the others there."""
    out = np.zeros(len(rest), bool)
    if rest.any():
        away = np.abs(force[rest] - np.median(force[rest], axis=0))
        out[rest] = (away > KNOCK * np.maximum(deviation(force[rest]), 1e-3)).any(axis=1)
    return out


def _jolts(force: np.ndarray, rates: np.ndarray | None, air: np.ndarray) -> np.ndarray:
    """Samples (n,) around those at which the vehicle hit something in flight."""
    out = np.zeros(len(air), bool)
    turning = np.zeros((len(air), 0)) if rates is None else np.diff(rates, axis=0, prepend=rates[:1])
    for values in (*force.T, *turning.T):
        away = np.abs(values - np.median(values[air]))
        out |= air & (away > JOLT * max(float(deviation(values[air])), 1e-6))
    wide = int(CONTACT_S / PERIOD_S)
    out = np.convolve(out, np.ones(2 * wide + 1), "same") > 0.5
    return out if out[air].mean() < MOST_JOLTED else np.zeros_like(out)


def _period(time: np.ndarray) -> float:
    """The clock's period: the commonest step where most are alike, however many samples were lost."""
    steps = np.diff(time)
    usual = float(np.median(steps)) if len(steps) else 0.0
    if usual > 0.0 and np.mean(np.abs(steps - usual) < 0.02 * usual) > 0.7:
        return float(steps[np.abs(steps - usual) < 0.02 * usual].mean())
    return true_period(time) or PERIOD_S


def _near_contact(phase: np.ndarray, pwm: np.ndarray) -> np.ndarray:
    """Samples at which legs may touch: motors run on the ground, and around take-off and touch-down."""
    moving = pwm.max(axis=1) > 0.0
    rest = (phase == GROUND) & ~moving
    touching = (phase == GROUND) & moving
    change = np.diff(((phase == GROUND) | ~moving).astype(np.int8))
    wide = int(CONTACT_S / PERIOD_S)
    for k in np.flatnonzero(change):
        touching[max(k - wide, 0):k + wide] = True
    since = np.arange(len(moving)) - np.maximum.accumulate(np.where(moving, np.arange(len(moving)), -10 ** 6))
    touching |= rest & (since < SETTLED_S / PERIOD_S)
    before = rest & (np.cumsum(moving) == 0)
    before[np.argmax(moving) - 1 if moving.any() else 0:] = False
    return touching & ~before
