"""The IMU: two samples a physics step, as the firmware and the log get them."""

import math

import numpy as np

from airtouch.simulation.body.rotation import sine_and_cosine
from airtouch.simulation.compiled import inlined, jit
from airtouch.simulation.random_generator import normals
from airtouch.simulation.sensors import filters

_F = np.float64
DELAY_ROWS = 128  #: of the delay line, one a millisecond
LEAD = math.cos(0.7), math.sin(0.7)  #: of the vibration along z, which is 0.7 rad ahead of that along x
_LOWPASSES = ("acc_log", "acc_filter", "gyro_chip", "gyro_filter")
STATE = np.dtype([
    ("motion", _F, (6,)),  # true specific force (m/s^2) and rates (rad/s) now
    ("motion_before", _F, (6,)),  # and a step ago
    ("acc", _F, (3,)),  # m/s^2, the last sample as logged
    ("gyro", _F, (3,)),  # rad/s
    ("delay_line", _F, (DELAY_ROWS, 6)),  # samples as the firmware filters them
    ("acc_rms", _F, (3,)),  # m/s^2, white noise before the low-passes
    ("gyro_rms", _F, (3,)),  # rad/s
    *((name, _F, (5,)) for name in _LOWPASSES),  # coefficients
    *((f"{name}_past", _F, (3, 2)) for name in _LOWPASSES),  # what each low-pass keeps, by axis
    ("normals", _F, (6,)),  # working space
])


@jit
def begin(plant, state):
    """Filters settled for a vehicle at rest, noise levels before them."""
    s, lowpasses = state.imu, plant.firmware.filters
    filters.lowpass_coefficients(plant.acc_lowpass, 0.001, s.acc_log)
    filters.lowpass_coefficients(lowpasses.acc_hz, 0.001, s.acc_filter)
    filters.lowpass_coefficients(plant.gyro_bandwidth, 0.001, s.gyro_chip)
    filters.lowpass_coefficients(plant.gyro_lowpass, 0.001, s.gyro_filter)
    acc_gain, gyro_gain = filters.noise_gain(s.acc_log), filters.noise_gain(s.gyro_chip)
    s.motion_before[2] = plant.gravity
    for i in range(3):
        s.acc_rms[i], s.gyro_rms[i] = plant.acc_noise[i] / acc_gain, plant.gyro_noise[i] / gyro_gain
        still = plant.acc_bias[i] + (plant.gravity if i == 2 else 0.0)
        filters.settle(s.acc_log, s.acc_log_past[i], still)
        filters.settle(s.acc_filter, s.acc_filter_past[i], still)
        filters.settle(s.gyro_chip, s.gyro_chip_past[i], plant.gyro_bias[i])
        filters.settle(s.gyro_filter, s.gyro_filter_past[i], plant.gyro_bias[i])


@jit
def _motion(plant, body, out):
    """True specific force at the sensor, in the geometric centre, and rates into out (6,)."""
    slope, wrench = body.slope, body.wrench
    lift = 0.0
    for i in range(4):
        lift += plant.thrust_per_speed2 * body.rotor_speed[i] * body.rotor_speed[i] * body.gain[i]
    rx, ry, rz = -plant.com[0], -plant.com[1], -plant.com[2]
    wx, wy, wz = body.state[10], body.state[11], body.state[12]
    dx, dy, dz = slope[10], slope[11], slope[12]
    dot = wx * rx + wy * ry + wz * rz
    square = wx * wx + wy * wy + wz * wz
    out[0] = wrench[0] / plant.mass + dy * rz - dz * ry + wx * dot - rx * square
    out[1] = wrench[1] / plant.mass + dz * rx - dx * rz + wy * dot - ry * square
    out[2] = (wrench[2] + lift) / plant.mass + dx * ry - dy * rx + wz * dot - rz * square
    out[3], out[4], out[5] = wx, wy, wz


@jit
def _shake(plant, state, hover_speed, before_s):
    """Vibration of the rotors at the sensor along x, y, z, m/s^2, before_s seconds before the step."""
    x, y, z = 0.0, 0.0, 0.0
    if plant.vibration > 0.0:
        for i in range(4):
            speed = state.body.rotor_speed[i]
            size = 0.5 * plant.vibration * (speed / hover_speed) ** 2
            sine, cosine = sine_and_cosine(state.motors.phase[i] - before_s * speed)
            x += size * sine
            y += size * cosine
            z += size * (LEAD[0] * sine + LEAD[1] * cosine)
    return x, y, z


@jit
def sense(plant, state, hover_speed, generator):
    """The IMU's stage of physics step k: samples of ticks 2 k - 1 (half-way from the last step) and 2 k.

    hover_speed: rad/s of a rotor in hover; generator: random numbers of the IMU. acc, gyro of state.imu are the later
    one as logged; its delay line holds both as the firmware filters them.
    """
    s = state.imu
    _motion(plant, state.body, s.motion)
    for half in range(2):
        row = (2 * state.step - 1 + half) & (DELAY_ROWS - 1)
        normals(generator, s.normals[:])
        shake_x, shake_y, shake_z = _shake(plant, state, hover_speed, (1 - half) * 0.001)
        for i in range(3):
            shake = shake_x if i == 0 else (shake_y if i == 1 else shake_z)
            force, rate = s.motion[i], s.motion[3 + i]
            if half == 0:
                force, rate = 0.5 * (force + s.motion_before[i]), 0.5 * (rate + s.motion_before[3 + i])
            _acc_sample(plant, s, row, i, force, shake)
            _gyro_sample(plant, s, row, i, rate, shake)
    for i in range(6):
        s.motion_before[i] = s.motion[i]
    if state.step == 0:
        for j in range(DELAY_ROWS):
            for i in range(6):
                s.delay_line[j, i] = s.delay_line[0, i]


@inlined
def _acc_sample(plant, s, row, i, force, shake):
    """Axis i of the accelerometer: the log's low-pass and, into a row of the delay line, the firmware's."""
    value = force + plant.acc_bias[i] + s.acc_rms[i] * s.normals[i]
    logged = filters.lowpass(s.acc_log, s.acc_log_past[i], value) + shake
    s.acc[i] = min(max(logged, -plant.acc_range), plant.acc_range)
    value = min(max(value + shake, -plant.acc_range), plant.acc_range)
    s.delay_line[row, i] = filters.lowpass(s.acc_filter, s.acc_filter_past[i], value)


@inlined
def _gyro_sample(plant, s, row, i, rate, shake):
    """Axis i of the gyro: the chip's low-pass for the log, then the firmware's into a row of the delay line."""
    value = plant.gyro_scale[i] * rate + plant.gyro_bias[i] + s.gyro_rms[i] * s.normals[3 + i]
    value = filters.lowpass(s.gyro_chip, s.gyro_chip_past[i], value)
    value += plant.vibration_gyro * shake
    s.gyro[i] = min(max(value, -plant.gyro_range), plant.gyro_range)
    s.delay_line[row, 3 + i] = filters.lowpass(s.gyro_filter, s.gyro_filter_past[i], s.gyro[i])


@jit
def reading(plant, state, tick):
    """Fill acc and gyro of the firmware's reading at a tick (ms), plant.sensor_delay late."""
    line, late, out = state.imu.delay_line, 1000.0 * plant.sensor_delay, state.firmware.reading
    for i in range(3):
        out.acc[i] = filters.delayed(line, tick, late, i)
        out.gyro[i] = filters.delayed(line, tick, late, 3 + i)
