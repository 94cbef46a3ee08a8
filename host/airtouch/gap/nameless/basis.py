"""The flight's own signals, on which a hypothesis's residual is regressed (gap.nameless.regression)."""

import numpy as np

from airtouch.gap.flights.filters import lagged
from airtouch.gap.flights.flight import PERIOD_S, Flight
from airtouch.gap.loop.command_spectra import MIX
from airtouch.simulation import signals as at
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

# Scales that make columns of order one in flights of some 20 s near the ground; all are chosen. Those of thrust and
# time only scale a column, and its coefficient the other way; those of the height say how fast a force fades with it.
LAG_S = 0.05  #: s, multiplies the derivatives of thrust; a larger number makes their columns larger
TIME_S = 20.0  #: s, divides the time; a larger number makes its columns smaller
#: m, height of a rotor at which its ground effect (HEIGHT_M / height)^2 is 1, as at any lower one; a larger number
#: makes the column larger, and flat up to a greater height
HEIGHT_M = 0.05
#: m above the ground at which 1 / (1 + (height / LOW_M)^2), a force that fades slowly, is a half; with a larger number
#: it fades at greater heights
LOW_M = 0.2
#: names of the columns: "in_air" is 1 in the air; "near" and its products are of the rotors' ground effect, "low" of
#: LOW_M
BASIS = ("one", "in_air", "thrust", "roll", "pitch", "yaw", "d_thrust", "d_roll", "d_pitch", "d_yaw", "vx", "vy",
         "vz", "speed", "world_x", "world_y", "world_z", "time", "time_thrust", "near",
         "near_roll", "near_pitch", "low", "height")


def basis(flight: Flight, vehicle: Vehicle) -> np.ndarray:
    """Signals (n, len(BASIS), 3) of a flight, of order one; the last axis: for channels along x, y and z.

    0 on the ground, but for the constant. roll, pitch, yaw: differences of the rotors' thrust over the weight; d_: the
    derivative; world_: an axis of the world seen from the body.
    """
    row = prepare(vehicle, ())[0][0]
    air = ~flight.on_ground
    decay = float(np.exp(-PERIOD_S / row["motor_rise"]))
    thrust = lagged(decay, vehicle.thrust(flight.pwm)) @ MIX.T
    thrust /= 0.25 * float(row["mass"]) * vehicle.gravity_mps2
    changing = np.gradient(thrust, axis=0) / PERIOD_S * LAG_S
    velocity = flight.signals[:, at.VELOCITY:at.VELOCITY + 3]
    time = np.arange(len(flight)) * PERIOD_S / TIME_S
    of_rotors = (HEIGHT_M / np.maximum(flight.signals[:, at.LOWER_HEIGHT:at.LOWER_HEIGHT + 4], HEIGHT_M)) ** 2
    near = of_rotors @ MIX[:3].T
    height = flight.signals[:, at.HEIGHT]
    low = 1.0 / (1.0 + (height / LOW_M) ** 2)
    columns = np.column_stack([np.ones(len(flight)), air, thrust, changing, velocity, np.hypot(*velocity[:, :2].T),
                               np.zeros((len(flight), 3)), time, time * thrust[:, 0], near, low, height])
    columns[:, 1:] *= air[:, None]
    out = np.repeat(columns[:, :, None], 3, axis=2)
    world_x = BASIS.index("world_x")
    out[:, world_x:world_x + 3] = flight.body_to_world * air[:, None, None]
    return out
