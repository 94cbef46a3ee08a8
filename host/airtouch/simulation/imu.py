"""The IMU: two samples a physics step, as the firmware and the log get them."""

import math

from airtouch.simulation import sensors
from airtouch.simulation.compiled import jit
from airtouch.simulation.random_stream import normals
from airtouch.simulation.rotation import sine_and_cosine

RING = 128  #: rows of the delay line, one a millisecond
LATER = math.cos(0.7), math.sin(0.7)  #: vibration along z is 0.7 rad ahead


@jit
def begin(plant, memory):
    """Filters settled for a vehicle at rest, noise levels before them."""
    firmware = plant.firmware
    sensors.lowpass_coefficients(plant.acc_lowpass, 0.001, memory.acc_log)
    sensors.lowpass_coefficients(firmware.filters.acc_hz, 0.001, memory.acc_filter)
    sensors.lowpass_coefficients(plant.gyro_bandwidth, 0.001, memory.gyro_chip)
    sensors.lowpass_coefficients(plant.gyro_lowpass, 0.001, memory.gyro_filter)
    acc_gain, gyro_gain = sensors.noise_gain(memory.acc_log), sensors.noise_gain(memory.gyro_chip)
    for i in range(3):
        memory.acc_rms[i], memory.gyro_rms[i] = plant.acc_noise[i] / acc_gain, plant.gyro_noise[i] / gyro_gain
    memory.motion[2] = plant.gravity
    for i in range(3):
        still = plant.acc_bias[i] + (plant.gravity if i == 2 else 0.0)
        sensors.settle(memory.acc_log, memory.acc_log_past[i], still)
        sensors.settle(memory.acc_filter, memory.acc_past[i], still)
        sensors.settle(memory.gyro_chip, memory.gyro_chip_past[i], plant.gyro_bias[i])
        sensors.settle(memory.gyro_filter, memory.gyro_past[i], plant.gyro_bias[i])


@jit
def _motion(plant, memory, out):
    """True specific force at the sensor, in the geometric centre, and rates into out (6,)."""
    state, slope, force = memory.state, memory.slope, memory.force
    lift = 0.0
    for i in range(4):
        lift += plant.thrust_per_speed2 * memory.speed[i] * memory.speed[i] * plant.gain[i]
    rx, ry, rz = -plant.com[0], -plant.com[1], -plant.com[2]
    wx, wy, wz = state[10], state[11], state[12]
    dx, dy, dz = slope[10], slope[11], slope[12]
    dot = wx * rx + wy * ry + wz * rz
    square = wx * wx + wy * wy + wz * wz
    out[0] = force[0] / plant.mass + dy * rz - dz * ry + wx * dot - rx * square
    out[1] = force[1] / plant.mass + dz * rx - dx * rz + wy * dot - ry * square
    out[2] = (force[2] + lift) / plant.mass + dx * ry - dy * rx + wz * dot - rz * square
    out[3], out[4], out[5] = wx, wy, wz


@jit
def sense(plant, memory, stream, hover, step):
    """Physics step number `step`: samples of ticks 2 step - 1 (half-way from the last step) and 2 step.

    memory.acc, memory.gyro (3,) are the later one as logged; memory.imu holds both as the firmware filters them.
    """
    _motion(plant, memory, memory.now)
    for half in range(2):
        row = (2 * step - 1 + half) & (RING - 1)
        normals(stream, memory.imu_normals[:])
        shake_x, shake_y, shake_z = 0.0, 0.0, 0.0
        if plant.vibration > 0.0:
            for i in range(4):
                size = 0.5 * plant.vibration * (memory.speed[i] / hover) ** 2
                sine, cosine = sine_and_cosine(memory.phase[i] - (1 - half) * 0.001 * memory.speed[i])
                shake_x += size * sine
                shake_y += size * cosine
                shake_z += size * (LATER[0] * sine + LATER[1] * cosine)
        for i in range(3):
            shake = shake_x if i == 0 else (shake_y if i == 1 else shake_z)
            force, rate = memory.now[i], memory.now[3 + i]
            if half == 0:
                force, rate = 0.5 * (force + memory.motion[i]), 0.5 * (rate + memory.motion[3 + i])
            value = force + plant.acc_bias[i] + memory.acc_rms[i] * memory.imu_normals[i]
            logged = sensors.lowpass(memory.acc_log, memory.acc_log_past[i], value) + shake
            memory.acc[i] = min(max(logged, -plant.acc_range), plant.acc_range)
            value = min(max(value + shake, -plant.acc_range), plant.acc_range)
            memory.imu[row, i] = sensors.lowpass(memory.acc_filter, memory.acc_past[i], value)
            value = plant.gyro_scale[i] * rate + plant.gyro_bias[i] + memory.gyro_rms[i] * memory.imu_normals[3 + i]
            value = sensors.lowpass(memory.gyro_chip, memory.gyro_chip_past[i], value)
            value += plant.vibration_gyro * shake
            memory.gyro[i] = min(max(value, -plant.gyro_range), plant.gyro_range)
            memory.imu[row, 3 + i] = sensors.lowpass(memory.gyro_filter, memory.gyro_past[i], memory.gyro[i])
    for i in range(6):
        memory.motion[i] = memory.now[i]
    if step == 0:
        for j in range(RING):
            for i in range(6):
                memory.imu[j, i] = memory.imu[0, i]


@jit
def sample(plant, memory, tick):
    """What the firmware has at a tick (ms) into memory.seen_acc and memory.seen_gyro: late by plant.sensor_delay."""
    late = 1000.0 * plant.sensor_delay
    for i in range(3):
        memory.seen_acc[i] = sensors.delayed(memory.imu, tick, late, i)
        memory.seen_gyro[i] = sensors.delayed(memory.imu, tick, late, 3 + i)
