"""A flight made ready for the diagnosis: a regular clock, what effects see, what was measured."""

from collections.abc import Container
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.flights import motion
from airtouch.gap.flights.clock import PERIOD_S, at_100_hz, with_lost_rows
from airtouch.gap.flights.contact import jolts, knocks, near_ground, within
from airtouch.gap.workspace import Workspace
from airtouch.logs.checks.quality import nothing_logged
from airtouch.logs.edges import true_edges
from airtouch.logs.flight_log import ACC, ATTITUDE, GYRO, PWM, RANGES, FlightLog
from airtouch.logs.segments import KINDS, PLATFORM_STEP_M, segments
from airtouch.simulation import replay
from airtouch.simulation import signals as at
from airtouch.simulation.body.rotation import as_matrix
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

GROUND = KINDS.index("ground")
LEAST_AIR_S = 3.0  #: seconds in the air that a flight needs to be diagnosed; chosen
LARGEST = 1e5  #: magnitude above which a value is none, in any column's unit; chosen, beyond what any sensor says
PWM_RANGE = (-1.0, 66000.0)  #: of a motor command, which has 16 bits: 0 to 65535; its margins are chosen
LEAST_GOOD = 0.5  #: share of a column's values that must be possible, else the column is left out; chosen
#: height above standing, m, below which legs may touch in flight, and seconds before and after it; chosen
TOUCH_M, TOUCH_S = 0.006, 0.05
WITHOUT_GRAVITY = 0.5  #: share of gravity below which the median vertical force has gravity subtracted: between 0 and 1


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
    name = log.source
    log, notes = _without_bad_columns(log)
    log, clock, lost = with_lost_rows(at_100_hz(log, name), name)
    if _stamped_at_arrival(log):
        clock = np.zeros_like(clock)
    cannot = _cannot(log)
    angles = motion.attitude(log, PERIOD_S)
    turn = as_matrix(*angles.T)
    force = _body_force(log, turn, vehicle.gravity_mps2)
    phase = _phases(log)
    pwm = motion.interpolate_missing(log.stack(PWM))
    if (phase != GROUND).sum() * PERIOD_S < LEAST_AIR_S:
        raise AirTouchError(f"{name}: no flight in it ({(phase != GROUND).sum() * PERIOD_S:.1f} s in the air); "
                            f"at least {LEAST_AIR_S:g} s are needed")
    signals, touching = _signals(log, angles, turn, phase, vehicle)
    rates = motion.interpolate_missing(log.stack(GYRO)) if log.has(*GYRO) else None
    ground, running = phase == GROUND, pwm.max(axis=1) > 0.0
    usable = ~lost & ~near_ground(ground, running) & ~knocks(force, ground & ~running) & ~jolts(force, rates, ~ground)
    return Flight(name, log, signals, force, rates, pwm, turn, phase, usable, clock, lost,
                  touching, notes, cannot)


def without_columns(flight: Flight, vehicle: Vehicle, columns: Container[str]) -> Flight:
    """The flight as it would be made ready from a log without some columns, which are neither commands nor motion."""
    log = FlightLog({k: v for k, v in flight.log.columns.items() if k not in columns}, flight.log.meta)
    if len(log.columns) == len(flight.log.columns):
        return flight
    angles = motion.attitude(log, PERIOD_S)
    return replace(flight, log=log, signals=_signals(log, angles, flight.turn, flight.phase, vehicle)[0])


def _without_bad_columns(log: FlightLog) -> tuple[FlightLog, tuple[str, ...]]:
    """The log without impossible values and columns that hold few others, and notes on what it lacks.

    Raises AirTouchError where nothing was logged, without motor commands or accelerations, and for a single sample.
    """
    name = log.source
    if nothing_logged(log):
        raise AirTouchError(f"{name}: nothing was logged: every value of every channel is missing (NaN)")
    notes = [f"{Path(name).name}: {w}" for w in log.meta.get("warnings", []) if "cut off" in str(w)]
    log, unfit = _without_impossible_values(log)
    if unfit:
        notes.append(f"left out, as most of it is missing or out of range: {', '.join(unfit)}")
    for columns, what in ((PWM, "motor commands"), (ACC, "accelerations")):
        if not log.has(*columns):
            raise AirTouchError(f"{name}: no {what} ({', '.join(columns)}); log them, the diagnosis "
                                "compares what the motors were told with what the IMU felt")
    if len(log) < 2:
        raise AirTouchError(f"{name}: {len(log)} samples; at least {LEAST_AIR_S:g} s of flight are needed")
    return log, tuple(notes)


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
    force = motion.interpolate_missing(log.stack(ACC))
    if log.meta.get("acc_frame") == "world":
        force = np.einsum("nji,nj->ni", turn, force)
        if np.median(force[:, 2]) < WITHOUT_GRAVITY * gravity:
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
    whole = {name: motion.interpolate_missing(values) for name, values in known.columns.items()}
    signals = replay.signals_of(FlightLog(whole, known.meta), vehicle, (), PERIOD_S)
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
        touching = within(low, TOUCH_S)
    return signals, touching


def _without_impossible_values(log: FlightLog) -> tuple[FlightLog, list[str]]:
    """The log without values that cannot be and without columns that have few others; their names."""
    columns, unfit = {}, []
    for key, values in log.columns.items():
        low, high = PWM_RANGE if key in PWM else (-LARGEST, LARGEST)
        good = (values >= low) & (values <= high)
        if len(good) and good.mean() < LEAST_GOOD:
            unfit += [key] if key not in RANGES else []
        else:
            columns[key] = np.where(good, values, np.nan)
    return FlightLog(columns, log.meta), unfit
