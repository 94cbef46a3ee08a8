"""The firmware in the loop: estimator task, then controllers, mixer, battery compensation and cap."""

import math

import numpy as np

from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware import (
    battery_compensation,
    controller,
    estimator,
    kalman,
    mixer,
    range_module,
    setpoint,
)

_F = np.float64
#: ms after the motors' last turn in which the firmware still takes itself to be flying: IS_FLYING_HYSTERESIS_THRESHOLD
#: of crazyflie-firmware's supervisor.c
FLYING_MS = 2000
STATE = np.dtype([
    ("kalman", kalman.STATE),
    ("range_module", range_module.STATE),
    ("controller", controller.STATE),
    ("reading", estimator.READING),  # from the sensors to the estimator
    ("estimate", controller.ESTIMATE),  # from the estimator to the controllers
    ("setpoint", controller.SETPOINT),
    ("angles", _F, (3,)),  # rad, roll, pitch (nose down) and yaw of the estimate
    ("thrust_tick", np.int64),  # ms, when the motors last turned
    ("supply", _F),  # V, of the battery, filtered
    ("quaternion", _F, (4,)),  # working space
])


@jit
def begin(plant, state, roll, pitch, yaw):
    """Start the estimator at the true position over the floor, with small attitude errors (rad); reset the loops."""
    s, pose = state.firmware, state.body.state
    est, q = s.kalman, s.quaternion
    q[0], q[3] = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    kalman.begin(plant.firmware, est, pose[0], pose[1], pose[2] - plant.range_below_rotors, q)
    est.updated, est.d[0], est.d[1] = 1, roll, pitch
    kalman.finalize(est)
    _publish(s)
    for i in range(3):
        s.estimate.attitude[i] = math.degrees(s.angles[i])
    controller.reset(plant.firmware, s.controller, s.estimate)
    s.controller.attitude[2] = s.estimate.attitude[2]
    s.thrust_tick, s.supply = -FLYING_MS, plant.nominal_voltage


@jit
def _publish(s):
    """Angles, place and velocity (world axes) of the Kalman filter's estimate."""
    r = s.kalman.r
    s.angles[0] = math.atan2(r[2, 1], r[2, 2])
    s.angles[1] = -math.asin(min(max(r[2, 0], -1.0), 1.0))
    s.angles[2] = math.atan2(r[1, 0], r[0, 0])
    kalman.world_velocity(s.kalman, s.estimate.velocity)
    for i in range(3):
        s.estimate.position[i] = s.kalman.x[i]


@jit
def estimate(plant, state, tick, volts):
    """The estimator's stage of a tick (ms), with the tick's reading; volts: voltage at the motors."""
    s = state.firmware
    flying = tick - s.thrust_tick < FLYING_MS
    estimator.tick(plant, s.kalman, tick, flying, s.reading)
    s.supply = battery_compensation.smoothed(plant.firmware, s.supply, volts)


@jit
def steer(plant, state, row, tick):
    """The controllers' stage of a tick (ms) for a set-point row (8,): state.motors.pwm, whole numbers 0..65535."""
    s, settings, pwm = state.firmware, plant.firmware, state.motors.pwm
    if row[setpoint.MOTORS] > 0.5:
        s.thrust_tick = tick
    if tick % settings.periods.attitude_ms != 0:
        return
    _publish(s)
    for i in range(3):
        s.estimate.attitude[i] = math.degrees(s.angles[i])
        s.estimate.rate[i] = math.degrees(s.reading.gyro[i])
    s.estimate.attitude[1] = -s.estimate.attitude[1]  # the firmware's pitch is nose up
    setpoint.to_firmware(row, s.setpoint)
    controller.run(plant, s.controller, s.setpoint, s.estimate, tick)
    command = s.controller.command
    mixer.mix(s.controller.thrust, command[0], command[1], command[2], pwm)
    battery_compensation.apply(settings, plant, s.supply, pwm)
    mixer.cap(pwm)
