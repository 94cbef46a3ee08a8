"""Everything that changes in flight, as one record of named parts that compiled code reads and writes.

Each stage owns its part and says in its own module what the fields are. With the record a flight can be flown a few
rows at a time (`loop.fly` continues where it stopped), with the same numbers as in one call.
"""

import math

import numpy as np
from numba import from_dtype, types

from airtouch.simulation.body import battery, contact, forces, motors, rigid_body
from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware import autopilot, setpoint
from airtouch.simulation.firmware.setpoint import ROW
from airtouch.simulation.flight_plan import world
from airtouch.simulation.flight_plan.world import WORLD
from airtouch.simulation.plant import PLANT
from airtouch.simulation.random_generator import GENERATOR, normal
from airtouch.simulation.sensors import imu, ranging

_F = np.float64
PHASE_TURNS = 0.381966  #: turns between the first phases of two rotors, plus 1 rad of noise; chosen: no two alike
START_TILT_RAD = 0.005  #: rad, rms error of roll and pitch in the first estimate; chosen, half of std_attitude_rad
DTYPE = np.dtype([
    ("step", np.int64),  # physics steps flown
    ("time_s", _F),  # of this step
    ("body", rigid_body.BODY),
    ("motors", motors.STATE),
    ("battery", battery.STATE),
    ("imu", imu.STATE),
    ("ranging", ranging.STATE),
    ("walls", _F, (4,)),  # m, the Multi-ranger: front, back, left, right; NaN: none
    ("firmware", autopilot.STATE),
    ("forces", forces.STATE),
])
STATE = from_dtype(DTYPE)[::1]  #: in compiled code


def empty() -> np.ndarray:
    """A record (1,) of DTYPE, all zero, as `begin` needs it."""
    return np.zeros(1, DTYPE)


@jit(types.void(PLANT, WORLD, ROW, GENERATOR, STATE))
def begin(plants, ground, row, generator, states):
    """Stand the vehicle on the surface below the first set-point row (8,). The record (1,) must be all zero."""
    plant, state = plants[0], states[0]
    body, pose = state.body, state.body.state
    pose[0], pose[1] = row[setpoint.X], row[setpoint.Y]
    ranging.begin(state.ranging, world.top_at(ground, pose[0], pose[1]))
    leg = plant.range_below_rotors + plant.leg_below_range
    pose[2] = state.ranging.start_top + leg - contact.SINK_M
    yaw = row[setpoint.YAW]
    pose[6], pose[9] = math.cos(yaw / 2), math.sin(yaw / 2)
    for i in range(4):
        state.motors.phase[i] = 6.283185307179586 * i * PHASE_TURNS + normal(generator)
        body.gain[i] = plant.gain[i]
        state.walls[i] = np.nan
    body.wrench[2] = plant.mass * plant.gravity
    state.battery.charge, state.battery.volts = plant.battery_charge, plant.nominal_voltage
    roll, pitch = START_TILT_RAD * normal(generator), START_TILT_RAD * normal(generator)
    imu.begin(plant, state)
    autopilot.begin(plant, state, roll, pitch, yaw)
    rigid_body.derivative(plant, body)
