"""What a flight keeps from one step to the next: one record that compiled code reads and writes by name.

With it a flight can be flown a few rows at a time (`loop.fly` continues where it stopped),
with the same numbers as in one call.
"""

import math

import numpy as np
from numba import float64, from_dtype, int64, types

from airtouch.simulation import autopilot, contact, imu, ranging, rigid_body, setpoint, world
from airtouch.simulation import signals as at
from airtouch.simulation.compiled import jit
from airtouch.simulation.effects.effect import MEMORY
from airtouch.simulation.firmware import controller, estimator, kalman, range_module
from airtouch.simulation.plant import DTYPE
from airtouch.simulation.random_stream import STREAM, normal
from airtouch.simulation.sensors import RING

SLOTS = 16  #: effects with a wrench that may be on at once
_F, _I = np.float64, np.int64
_FILTERS = ("acc_log", "acc_filter", "gyro_chip", "gyro_filter")  #: coefficients of the IMU's low-passes
_PASTS = ("acc_log_past", "acc_past", "gyro_chip_past", "gyro_past")  #: and their memories
MEMORY_DTYPE = np.dtype([
    ("step", _I),
    # the body: position, velocity, attitude, rates; rotor speeds; effects' force and torque; slope of the state
    ("state", _F, (13,)), ("speed", _F, (4,)), ("force", _F, (6,)), ("slope", _F, (13,)), ("ground", _F),
    ("charge", _F), ("volts", _F), ("effects", _F, (SLOTS, MEMORY)),
    # motors: their command and its delay line, noise, phase, thrust of each over nominal
    ("pwm", _F, (4,)), ("commands", _F, (RING, 4)), ("slowed", _F, (4,)), ("held", _F, (4,)), ("flicker", _F, (8,)),
    ("phase", _F, (4,)), ("gain", _F, (4,)),
    # the IMU: true motion at the last step and now, samples as logged and as filtered, what the firmware has
    ("motion", _F, (6,)), ("now", _F, (6,)), ("acc", _F, (3,)), ("gyro", _F, (3,)), ("imu", _F, (imu.RING, 6)),
    ("seen_acc", _F, (3,)), ("seen_gyro", _F, (3,)), ("acc_rms", _F, (3,)), ("gyro_rms", _F, (3,)),
    *((name, _F, (5,)) for name in _FILTERS), *((name, _F, (3, 2)) for name in _PASTS),
    # ranging: measurements not yet handed over, what is below, the last reading's offset, flow noise, walls
    ("looks", _I), ("distances", _F, (ranging.RANGES,)), ("tops", _F, (ranging.RANGES,)),
    ("kicks", _F, (ranging.RANGES,)), ("flows", _F, (ranging.FLOWS, 2)), ("top", _F), ("beneath", _F), ("changed", _F),
    ("rose", _F), ("down", _F), ("offset", _F), ("drift", _F, (3,)), ("ranges", _F, (4,)),
    # the firmware: its own state, and what it hands from part to part
    ("est", kalman.STATE), ("module", range_module.STATE), ("pid", controller.STATE),
    ("setpoint", controller.SETPOINT), ("reading", estimator.READING), ("thrust_tick", _I), ("supply", _F),
    ("angles", _F, (3,)), ("velocity", _F, (3,)), ("degrees", _F, (3,)), ("rates", _F, (3,)),
    ("quaternion", _F, (4,)),
    # working space
    ("target", _F, (4,)), ("middle", _F, (13,)), ("middle_speed", _F, (4,)), ("motor_normals", _F, (4,)),
    ("imu_normals", _F, (6,)), ("other_normals", _F, (4,)), ("world_force", _F, (3,)), ("patch", _F, (7,)),
    ("signals", _F, (at.COUNT,))])

_BEGIN = types.void(from_dtype(DTYPE)[::1], float64[:, ::1], int64[::1], float64[:, ::1], float64[:, ::1],
                    float64[::1], STREAM, from_dtype(MEMORY_DTYPE)[::1])


def memory() -> np.ndarray:
    """A memory (1,) of MEMORY_DTYPE, all zero as `begin` expects it."""
    return np.zeros(1, MEMORY_DTYPE)


@jit(_BEGIN)
def begin(plant_array, corners, first, surface, box, row, stream, memory_array):
    """Stand the vehicle on what is below the first set-point row (8,): fills a memory (1,) that is all zero."""
    plant, memory = plant_array[0], memory_array[0]
    state = memory.state
    leg = plant.range_below_rotors + plant.leg_below_range
    state[0], state[1] = row[setpoint.X], row[setpoint.Y]
    memory.ground = world.top_at(corners, first, surface, box, state[0], state[1])
    state[2] = memory.ground + leg - contact.SINK_M
    yaw = row[setpoint.YAW]
    state[6], state[9] = math.cos(yaw / 2), math.sin(yaw / 2)
    for i in range(4):
        memory.phase[i] = 6.283185307179586 * i * 0.381966 + normal(stream)
        memory.gain[i] = plant.gain[i]
        memory.ranges[i] = np.nan
    memory.force[2] = plant.mass * plant.gravity
    memory.top = memory.beneath = memory.ground
    memory.charge, memory.volts = plant.battery_charge, plant.nominal_voltage
    memory.down, memory.changed = 0.01, -ranging.LAST
    roll, pitch = 0.005 * normal(stream), 0.005 * normal(stream)
    imu.begin(plant, memory)
    autopilot.begin(plant, memory, roll, pitch, yaw)
    rigid_body.derivative(plant, state, memory.speed, 0.0, 0.0, memory.force, memory.slope)
