"""A flight made ready for the diagnosis: a regular clock, what effects see, what was measured."""

from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, count
from pathlib import Path
from typing import Protocol, TypeVar

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.flights.attitude import attitude, in_world_axes, world_force
from airtouch.gap.flights.clock import PERIOD_S, at_100_hz, with_lost_rows
from airtouch.gap.flights.contact import TOUCH_M, TOUCH_S, jolts, knocks, near_ground, standing, within
from airtouch.gap.flights.fitness import LEAST_AIR_S, cannot_tell, notes_of, stamped_at_arrival, without_bad_columns
from airtouch.gap.flights.heights import rotor_heights, standing_height
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.gap.workspace import Workspace
from airtouch.logs.flight_log import ACC, ATTITUDE, GYRO, PWM, FlightLog
from airtouch.logs.in_flight import flies_below_in_words
from airtouch.logs.resample import LONGEST_BRIDGE_S
from airtouch.logs.segments import KINDS, runs, segments
from airtouch.simulation import replay
from airtouch.simulation import signals as at
from airtouch.simulation.body.rotation import as_matrix
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

GROUND = KINDS.index("ground")
#: samples of a hole in a column up to which a straight line stands for what was measured, as where a log is resampled
MOST_BRIDGED = round(LONGEST_BRIDGE_S / PERIOD_S)
HOLE_NOTE = ("{:.1f} s in the air are no evidence: accelerations, rates or motor commands are missing there for more "
             "than {:g} s at a time; they do not count as lost rows")

GYRO_UNUSED = "the baseline flights have no gyro: that of the flights is not used; log it in both"
BASELINE_GYRO_UNUSED = "the flights have no gyro: that of the baseline flights is not used; log it in both"


@dataclass(frozen=True)
class Flight:
    """One flight of n samples on a regular 10 ms clock.

    signals (n, simulation.signals.COUNT): what effects see; acceleration (n, 3): specific force in body axes, m/s^2;
    rates (n, 3): of the gyro, rad/s, None without one; pwm (n, 4): motor commands, 16 bits; body_to_world (n, 3, 3):
    rotation; phase (n,): places in `segments.KINDS`; usable (n,): measured, and not close to a touch of the ground;
    clock_s (m,): logged times of the rows that arrived minus the regular ones, as far as those are sure; lost (n,):
    rows that did not arrive; unmeasured (n,): rows that did, in a hole of a column of the IMU or of the motor commands
    that is longer than LONGEST_BRIDGE_S; touching (n,): in flight, so low that the legs may touch; notes, cannot:
    sentences on what was left out of the log, and on what no diagnosis of it can tell.
    """

    name: str
    log: FlightLog
    signals: np.ndarray
    acceleration: np.ndarray
    rates: np.ndarray | None
    pwm: np.ndarray
    body_to_world: np.ndarray
    phase: np.ndarray
    usable: np.ndarray
    clock_s: np.ndarray
    lost: np.ndarray
    unmeasured: np.ndarray
    touching: np.ndarray
    notes: tuple[str, ...] = ()
    cannot: tuple[str, ...] = ()
    workspace: Workspace = field(default_factory=Workspace, init=False, compare=False, repr=False)

    def __len__(self) -> int:
        return len(self.pwm)

    @property
    def file_name(self) -> str:
        """Its name without the folders of its file."""
        return Path(self.name).name

    @property
    def has_gyro(self) -> bool:
        """Whether its rates are logged."""
        return self.rates is not None

    @property
    def bridged(self) -> np.ndarray:
        """Samples whose residual is not evidence, bool (n,): not measured, or the legs may touch the floor."""
        return self.not_logged | self.touching

    @property
    def not_logged(self) -> np.ndarray:
        """Samples that straight lines stand for, bool (n,): the row was lost, or it lacks what is measured."""
        return self.lost | self.unmeasured

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
    log, notes = without_bad_columns(log)
    notes += tuple(f"{Path(name).name}: {w}" for w in flies_below_in_words(log, vehicle.arm_pwm))
    log, clock, lost = with_lost_rows(at_100_hz(log, name), name)
    if stamped_at_arrival(log):
        clock = np.zeros_like(clock)
    cannot, phase = cannot_tell(log), _phases(log, vehicle.arm_pwm)
    ground = phase == GROUND
    _check_long_enough(~ground, name, "in the air")
    angles = attitude(log)
    body_to_world = as_matrix(*angles.T)
    force = _body_force(log, body_to_world, vehicle.gravity_mps2)
    signals, touching = _signals(log, angles, body_to_world, phase, vehicle)
    rates = interpolate_missing(log.stack(GYRO)) if log.has(*GYRO) else None
    pwm = interpolate_missing(log.stack(PWM))
    running = pwm.max(axis=1) > 0.0
    unmeasured = _long_holes(log) & ~lost
    if (unmeasured & ~ground).any():
        notes = (*notes, HOLE_NOTE.format((unmeasured & ~ground).sum() * PERIOD_S, LONGEST_BRIDGE_S))
    near = near_ground(ground | _standing(log, ground, running, vehicle), running)
    touched = near | knocks(force, ground & ~running) | jolts(force, rates, ~ground)
    usable = ~lost & ~unmeasured & ~touched
    _check_long_enough(~ground & usable, name, "in the air without a lost row or contact")
    return Flight(name=name, log=log, signals=signals, acceleration=force, rates=rates, pwm=pwm,
                  body_to_world=body_to_world, phase=phase, usable=usable, clock_s=clock, lost=lost,
                  unmeasured=unmeasured, touching=touching, notes=notes, cannot=cannot)


def _long_holes(log: FlightLog) -> np.ndarray:
    """Samples (n,), bool, in a hole of more than LONGEST_BRIDGE_S of a column of the IMU or of the motor commands."""
    missing = np.isnan(log.stack([c for c in (*ACC, *GYRO, *PWM) if log.has(c)])).T
    out = np.zeros(len(log), bool)
    for start, stop in (hole for column in missing for hole in runs(column)):
        out[start:stop] |= stop - start > MOST_BRIDGED
    return out


def _check_long_enough(samples: np.ndarray, name: str, which: str) -> None:
    """Raises AirTouchError, with the file `name`, for fewer than LEAST_AIR_S of samples (n,), bool; which: in words."""
    seconds = samples.sum() * PERIOD_S
    if seconds < LEAST_AIR_S:
        raise AirTouchError(f"{name}: no flight in it ({seconds:.1f} s {which}); at least {LEAST_AIR_S:g} s are needed")


def ready_flights(logs: Iterable[FlightLog], vehicle: Vehicle, reasons: list[str]) -> Iterator[Flight]:
    """Flights made ready, one at a time; the reasons why others cannot be are added to `reasons`.

    Each has a name of its own, as gates tell flights by it: the second of `a.csv` is `a.csv (2)`.
    """
    names: set[str] = set()
    for log in logs:
        try:
            flight = ready(log, vehicle)
        except AirTouchError as error:
            reasons.append(str(error))
            continue
        name = next(n for n in chain([flight.name], (f"{flight.name} ({i})" for i in count(2))) if n not in names)
        names.add(name)
        yield flight if name == flight.name else replace(flight, name=name)


class _Named(Protocol):
    """A flight, or what was measured in it."""

    @property
    def name(self) -> str:
        """Of the flight."""

    @property
    def has_gyro(self) -> bool:
        """Whether its rates are logged."""


_T = TypeVar("_T", bound=_Named)


def with_gyro_if_any(flights: Sequence[_T], reasons: list[str]) -> list[_T]:
    """The flights that have a gyro, or all where none has: one floor, one map, cannot hold for both kinds.

    The reason why others are left out is added to `reasons`.
    """
    with_gyro = [f for f in flights if f.has_gyro]
    if len(with_gyro) in (0, len(flights)):
        return list(flights)
    reasons += [f"{f.name}: no gyro, which the other flights have; left out" for f in flights if not f.has_gyro]
    return with_gyro


def ready_alike(flights: Sequence[FlightLog], baseline: Sequence[FlightLog], vehicle: Vehicle,
                of_flights: list[str], of_baseline: list[str]) -> tuple[list[Flight], list[Flight]]:
    """The flights and those of the baseline made ready, all with a gyro or all without: one floor holds for them.

    Where the flights alone or the baseline alone have one, it is not used. The reasons why some are left out, and the
    note that a gyro is, are added to `of_flights` and `of_baseline`.
    """
    def made(logs: Sequence[FlightLog], reasons: list[str]) -> list[Flight]:
        """Those that can be used, all with a gyro or all without."""
        return with_gyro_if_any(list(ready_flights(logs, vehicle, reasons)), reasons)

    nominal, usable = made(baseline, of_baseline), made(flights, of_flights)
    if nominal and usable and nominal[0].has_gyro != usable[0].has_gyro:
        if usable[0].has_gyro:
            of_flights[:] = [GYRO_UNUSED]
            return made([without_gyro(log) for log in flights], of_flights), nominal
        of_baseline[:] = [BASELINE_GYRO_UNUSED]
        return usable, made([without_gyro(log) for log in baseline], of_baseline)
    return usable, nominal


def without_gyro(log: FlightLog) -> FlightLog:
    """The log without the columns of the gyro."""
    return FlightLog({k: v for k, v in log.columns.items() if k not in GYRO}, log.meta)


def none_usable(reasons: Sequence[str], of_none: str = "no flight that can be used") -> AirTouchError:
    """The error where no flight can be used: the reason of the only one, or of the first; of_none: where none came."""
    if len(reasons) < 2:
        return AirTouchError(reasons[0] if reasons else of_none)
    return AirTouchError(f"no flight that can be used of {len(reasons)}; the first: {reasons[0]}")


def notes_on(flights: Sequence[Flight], nominal: Sequence[Flight]) -> list[str]:
    """The notes on flights and on those of the baseline."""
    return [*notes_of([(f.name, f.notes) for f in flights]),
            *notes_of([(f.name, f.notes) for f in nominal], "baseline flights")]


def without_columns(flight: Flight, vehicle: Vehicle, columns: Container[str]) -> Flight:
    """The flight as it would be made ready from a log without some columns, which are neither commands nor motion."""
    log = FlightLog({k: v for k, v in flight.log.columns.items() if k not in columns}, flight.log.meta)
    if len(log.columns) == len(flight.log.columns):
        return flight
    angles = attitude(log)
    return replace(flight, log=log, signals=_signals(log, angles, flight.body_to_world, flight.phase, vehicle)[0])


def _standing(log: FlightLog, ground: np.ndarray, running: np.ndarray, vehicle: Vehicle) -> np.ndarray:
    """`contact.standing` of a log, bool (n,); nowhere without a down range."""
    if not log.has("zrange_m"):
        return np.zeros(len(log), bool)
    return standing(log["zrange_m"], ground, running, float(prepare(vehicle, ())[0][0]["leg_below_range"]))


def _body_force(log: FlightLog, body_to_world: np.ndarray, gravity: float) -> np.ndarray:
    """Specific force (n, 3) m/s^2 in body axes. body_to_world (n, 3, 3): rotation; gravity: m/s^2."""
    if in_world_axes(log):
        return np.einsum("nji,nj->ni", body_to_world, world_force(log, ACC, gravity))
    return interpolate_missing(log.stack(ACC))


def _phases(log: FlightLog, arm_pwm: float) -> np.ndarray:
    """Phase of each sample, int8 (n,): places in `segments.KINDS`."""
    phase = np.zeros(len(log), np.int8)
    for part in segments(log, arm_pwm):
        phase[part.start:part.stop] = KINDS.index(part.kind)
    return phase


def _signals(log: FlightLog, angles: np.ndarray, body_to_world: np.ndarray, phase: np.ndarray, vehicle: Vehicle,
             ) -> tuple[np.ndarray, np.ndarray]:
    """Signals (n, COUNT) for effects, and `Flight.touching`. angles: (n, 3) rad, as the columns of ATTITUDE."""
    known = log.with_columns(dict(zip(ATTITUDE, angles.T, strict=True)))
    whole = {name: interpolate_missing(values) for name, values in known.columns.items()}
    signals = replay.signals_of(FlightLog(whole, known.meta), vehicle, (), PERIOD_S)
    row = prepare(vehicle, ())[0][0]
    heights = rotor_heights(log, body_to_world, row, phase == GROUND)
    touching = np.zeros(len(log), bool)
    if heights is None:
        return signals, touching
    signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4] = heights
    signals[:, at.UPPER_HEIGHT:at.UPPER_HEIGHT + 4] = heights
    if not log.has("zrange_m"):
        height = signals[:, at.HEIGHT] = heights.mean(axis=1)
        low = (phase != GROUND) & (height < standing_height(row) + TOUCH_M)
        touching = within(low, TOUCH_S)
    return signals, touching
