"""The firmware in the loop: estimator task, then controllers, mixer, battery compensation and cap."""

import math

from airtouch.simulation import setpoint
from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware import battery_compensation, controller, estimator, kalman, mixer

FLYING_MS = 2000  #: so long after the motors' last turn the firmware still takes itself to be flying


@jit
def begin(plant, memory, roll, pitch, yaw):
    """The estimator at the true place over the floor, its attitude off by small angles (rad); loops reset."""
    est, state, q = memory.est, memory.state, memory.quaternion
    q[0], q[3] = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    kalman.begin(plant.firmware, est, state[0], state[1], state[2] - plant.range_below_rotors, q)
    est.updated, est.d[0], est.d[1] = 1, roll, pitch
    kalman.finalize(est)
    _publish(memory)
    for i in range(3):
        memory.degrees[i] = math.degrees(memory.angles[i])
    controller.reset_at(plant.firmware, memory.pid, est.x, memory.degrees)
    memory.pid.attitude[2] = memory.degrees[2]
    memory.thrust_tick, memory.supply = -FLYING_MS, plant.nominal_voltage


@jit
def _publish(memory):
    """Angles (roll, pitch nose down, yaw; rad) and velocity (world axes) of the estimate."""
    r = memory.est.r
    memory.angles[0] = math.atan2(r[2, 1], r[2, 2])
    memory.angles[1] = -math.asin(min(max(r[2, 0], -1.0), 1.0))
    memory.angles[2] = math.atan2(r[1, 0], r[0, 0])
    kalman.world_velocity(memory.est, memory.velocity)


@jit
def estimate(plant, memory, tick, volts):
    """A tick (ms) of the estimator, with memory's IMU sample and reading."""
    flying = tick - memory.thrust_tick < FLYING_MS
    firmware = plant.firmware
    estimator.tick(firmware, memory.est, tick, flying, plant.gravity, memory.seen_acc, memory.seen_gyro,
                   memory.reading)
    memory.supply = battery_compensation.smoothed(firmware, memory.supply, volts)


@jit
def steer(plant, memory, row, tick):
    """A tick (ms) of the controllers for a set-point row (8,): memory.pwm (4,), whole numbers 0..65535."""
    firmware = plant.firmware
    if row[setpoint.MOTORS] > 0.5:
        memory.thrust_tick = tick
    if tick % firmware.periods.attitude_ms != 0:
        return
    _publish(memory)
    for i in range(3):
        memory.degrees[i] = math.degrees(memory.angles[i])
        memory.rates[i] = math.degrees(memory.seen_gyro[i])
    memory.degrees[1] = -memory.degrees[1]  # the firmware's pitch is nose up
    setpoint.to_firmware(row, memory.setpoint)
    controller.run(firmware, plant, memory.pid, memory.setpoint, tick, memory.est.x, memory.velocity, memory.degrees,
                   memory.rates)
    command = memory.pid.command
    mixer.mix(memory.pid.thrust, command[0], command[1], command[2], memory.pwm)
    battery_compensation.apply(firmware, plant, memory.supply, memory.pwm)
    mixer.cap(memory.pwm)
