"""The flight's own signals, for a regression of a hypothesis's residual (gap.nameless.model)."""

import numpy as np

from airtouch.gap.flights.filters import lagged
from airtouch.gap.flights.flight import PERIOD_S, Flight
from airtouch.gap.loop.command_spectra import MIX
from airtouch.simulation import signals as at
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

#: Units and lengths that make columns of order one in flights of some 20 s near the floor; all are chosen.
LAG_S = 0.05  #: s, unit of the derivatives of thrust
TIME_S = 20.0  #: s, unit of time
HEIGHT_M = 0.05  #: height of a rotor, m, at which its ground effect is one unit; the column is the same below
LOW_M = 0.2  #: m above the floor, at which a force that fades slowly has half its strength
BASIS = ("one", "in_air", "thrust", "roll", "pitch", "yaw", "d_thrust", "d_roll", "d_pitch", "d_yaw", "vx", "vy",
         "vz", "speed", "world_x", "world_y", "world_z", "time", "time_thrust", "near",
         "near_roll", "near_pitch", "low", "height")


def basis(flight: Flight, vehicle: Vehicle) -> np.ndarray:
    """Signals (n, columns, 3) that a flight holds, of order one; the last axis: of x, y and z channels."""
    row = prepare(vehicle, ())[0][0]
    air = ~flight.on_ground
    decay = float(np.exp(-PERIOD_S / row["motor_rise"]))
    thrust = lagged(decay, vehicle.thrust(flight.pwm)) @ MIX.T
    thrust /= 0.25 * float(row["mass"]) * vehicle.gravity_mps2
    changing = np.gradient(thrust, axis=0) / PERIOD_S * LAG_S
    speed = flight.signals[:, at.VELOCITY:at.VELOCITY + 3]
    time = np.arange(len(flight)) * PERIOD_S / TIME_S
    closeness = (HEIGHT_M / np.maximum(flight.signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4], HEIGHT_M)) ** 2
    height = closeness @ MIX[:3].T
    above = flight.signals[:, at.HEIGHT]
    low = 1.0 / (1.0 + (above / LOW_M) ** 2)
    columns = np.column_stack([np.ones(len(flight)), air, thrust, changing, speed, np.hypot(*speed[:, :2].T),
                               np.zeros((len(flight), 3)), time, time * thrust[:, 0], height, low, above])
    columns[:, 1:] *= air[:, None]
    out = np.repeat(columns[:, :, None], 3, axis=2)
    place = BASIS.index("world_x")
    out[:, place:place + 3] = flight.body_to_world * air[:, None, None]
    return out
