"""What a flight keeps from one step to the next, as one flat vector that compiled code slices.

With it a flight can be flown a few rows at a time (`loop.fly` continues where it stopped),
with the same numbers as in one call.
"""

import math

import numpy as np
from numba import float64, from_dtype, int64, types

from airtouch.simulation import contact, controller, estimator, rigid_body, sensors, world
from airtouch.simulation.compiled import jit
from airtouch.simulation.effects.effect import MEMORY
from airtouch.simulation import signals as at
from airtouch.simulation.plant import DTYPE
from airtouch.simulation.random_stream import STREAM, normal
from airtouch.simulation.sensors import RING

SLOTS = 16  #: effects with a wrench that may be on at once
#: scalars, at the start of the vector
(STEP, GROUND, CHARGE, VOLTS, DOWN, TOP, NEXT_RANGE, NEXT_RANGES, FLYING, CHANGED) = range(10)
_SIZES = (10, 13, 4, 6, 13, SLOTS * MEMORY, controller.SIZE, estimator.SIZE, 4, 8, 4, 4, RING * 6, RING * 4,
          5, 5, 6, 6, 3, 3, 4, 60 + at.COUNT)
(STATE, SPEED, FORCE, SLOPE, EFFECTS, PID, ESTIMATE, PWM, FLICKER, GAIN, PHASE, SENSED, COMMANDED,
 ACC_FILTER, GYRO_FILTER, ACC_MEMORY, GYRO_MEMORY, ACC_RMS, DRIFT, RANGES, SCRATCH, SIZE) = (
    sum(_SIZES[:i + 1]) for i in range(len(_SIZES)))


_BEGIN = types.void(from_dtype(DTYPE)[::1], float64[:, ::1], int64[::1], float64[:, ::1], float64[:, ::1],
                    float64[::1], STREAM, float64[::1])


@jit(_BEGIN)
def begin(plant_array, corners, first, surface, box, setpoint, stream, kept):
    """Stand the vehicle on what is below the first set-point (8,): fills kept (SIZE,)."""
    plant = plant_array[0]
    h = plant.step
    for i in range(SIZE):
        kept[i] = 0.0
    state, est, pid = kept[STATE:SPEED], kept[ESTIMATE:PWM], kept[PID:ESTIMATE]
    leg = plant.range_below_rotors + plant.leg_below_range
    acc_filter, gyro_filter = kept[ACC_FILTER:GYRO_FILTER], kept[GYRO_FILTER:ACC_MEMORY]
    sensors.lowpass_coefficients(plant.acc_lowpass, h, acc_filter)
    sensors.lowpass_coefficients(plant.gyro_lowpass, h, gyro_filter)
    gain = sensors.noise_gain(acc_filter)
    for i in range(3):
        kept[ACC_RMS + i] = plant.acc_noise[i] / gain
    state[0], state[1] = setpoint[controller.X], setpoint[controller.Y]
    ground = world.top_at(corners, first, surface, box, state[0], state[1])
    state[2] = ground + leg - contact.SINK_M
    yaw = setpoint[controller.YAW]
    state[6], state[9] = math.cos(yaw / 2), math.sin(yaw / 2)
    for i in range(4):
        kept[PHASE + i] = 6.283185307179586 * i * 0.381966 + normal(stream)
        kept[GAIN + i] = plant.gain[i]
        kept[RANGES + i] = np.nan
    est[0], est[1], est[2] = 0.005 * normal(stream), 0.005 * normal(stream), yaw
    est[6], est[7], est[8] = state[0], state[1], state[2] - plant.range_below_rotors
    controller.reset(pid, math.degrees(yaw))
    kept[FORCE + 2] = plant.mass * plant.gravity
    for i in range(3):
        at = ACC_MEMORY + 2 * i
        sensors.settle(acc_filter, kept[at:at + 2], plant.gravity if i == 2 else 0.0)
    kept[GROUND], kept[TOP], kept[CHARGE] = ground, ground, plant.battery_charge
    kept[VOLTS], kept[DOWN], kept[CHANGED] = plant.nominal_voltage, 0.01, -1e3
    rigid_body.derivative(plant, state, kept[SPEED:FORCE], 0.0, 0.0, kept[FORCE:SLOPE],
                          kept[SLOPE:EFFECTS])
