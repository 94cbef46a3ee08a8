"""The signals of one flight whose relations are looked at: commands, motion, what model and estimator leave open."""

from dataclasses import dataclass, replace

import numpy as np

from airtouch.gap.flights.contact import within
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.gap.loop.command_spectra import MIX
from airtouch.gap.signals.channels import FORCE, TORQUE, angular_acceleration, residual
from airtouch.logs.flight_log import ATTITUDE, GYRO, VELOCITY, FlightLog
from airtouch.simulation import signals as at
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

NEEDED = (*GYRO, *VELOCITY, *ATTITUDE, "zrange_m", "z_m")  #: columns beside commands and accelerations
#: columns of `FlightSignals.table`, by what they are of
COMMAND, ANGULAR_ACCELERATION, LIFT = slice(0, 4), slice(4, 7), slice(7, 8)
FORCE_RESIDUAL, TORQUE_RESIDUAL, SPEED_RESIDUAL = slice(8, 11), slice(11, 14), slice(14, 17)
ANGLE_RESIDUAL, RANGE_RESIDUAL = slice(17, 20), slice(20, 21)
#: their names, one by one
COLUMNS = ("thrust command", "roll command", "pitch command", "yaw command", *(f"turn {a}" for a in "xyz"), "lift",
           *(f"{what} residual {a}" for what in ("force", "torque", "speed", "angle") for a in "xyz"), "range residual")
COUNT = len(COLUMNS)
#: down range over standing below which legs may touch in flight, and for how long around it
LEGS_M, LEGS_S = 0.012, 0.15  # chosen
JUMP_MPS = 4.0  #: change of the down range from which another surface came below; chosen


@dataclass(frozen=True)
class FlightSignals:
    """Signals of a flight, bridged over lost rows.

    table (n, COUNT): collective, roll, pitch and yaw command, N per motor; angular acceleration, rad/s^2; force along
    the thrust, m/s^2; what the model leaves of force and torque (`channels.residual`); what estimated velocity,
    attitude and the down range change beyond what acceleration, gyro and estimated climb say (m/s^2, rad/s, m/s), as if
    the axes did not turn and the beam did not tilt. The shipped library was learned with these: the residuals without
    that approximation were tried and not taken (host/docs/looks.md, 2026-11-27 07:18).
    velocity (n, 3) m/s, body axes; angles (n, 3) rad, the heading as logged: 0 at first in simulated flights, for which
    alone the library holds; height (n,) m, estimated; air, rest (n,): samples in flight and standing that nothing
    touches and no row lacks; flight: without the moments of contact.
    """

    flight: Flight
    table: np.ndarray
    velocity: np.ndarray
    angles: np.ndarray
    height: np.ndarray
    air: np.ndarray
    rest: np.ndarray


def readable(log: FlightLog) -> bool:
    """Whether a log has every column that the signals need."""
    return log.has(*NEEDED)


def signals_of(flight: Flight, vehicle: Vehicle) -> FlightSignals:
    """The signals of a flight whose log is `readable`; vehicle: as declared, not as calibrated."""
    log = flight.log
    angles, velocity = interpolate_missing(log.stack(ATTITUDE)), flight.signals[:, at.VELOCITY:at.VELOCITY + 3]
    force = np.nan_to_num(residual(flight, vehicle))
    gravity = flight.body_to_world[:, 2, :] * vehicle.gravity_mps2
    assert flight.rates is not None  # `NEEDED` has the gyro
    rates = 0.5 * (flight.rates + np.roll(flight.rates, -1, axis=0))
    down = _rate(interpolate_missing(log["zrange_m"])[:, None])
    down = np.where(np.abs(down) > JUMP_MPS, 0.0, down) - interpolate_missing(log["vz_mps"])[:, None]
    table = np.column_stack([
        vehicle.thrust(flight.pwm) @ MIX.T, angular_acceleration(flight), flight.acceleration[:, 2],
        force[:, FORCE], force[:, TORQUE], _rate(velocity) - (flight.acceleration - gravity),
        _rate(np.unwrap(angles, axis=0)) - rates, down])
    if flight.bridged.any():
        table = interpolate_missing(np.where(flight.bridged[:, None], np.nan, table))
    touched = _touched(flight, vehicle)
    good = flight.usable & ~flight.bridged & ~touched
    rest = flight.on_ground & good
    return FlightSignals(replace(flight, usable=flight.usable & ~touched), table, velocity, angles,
                         interpolate_missing(log["z_m"]), (flight.phase != GROUND) & good,
                         rest if rest.any() else flight.on_ground)


def _rate(values: np.ndarray) -> np.ndarray:
    """Differences (n, c) to the next sample, per second; 0 in the last row."""
    return np.diff(values, axis=0, append=values[-1:]) / PERIOD_S


def _touched(flight: Flight, vehicle: Vehicle) -> np.ndarray:
    """Samples (n,) in flight around those at which the legs may touch what is below."""
    standing = float(prepare(vehicle, ())[0][0]["leg_below_range"])
    low = (flight.phase != GROUND) & (interpolate_missing(flight.log["zrange_m"]) < standing + LEGS_M)
    return within(low, LEGS_S)
