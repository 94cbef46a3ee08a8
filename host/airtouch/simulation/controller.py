"""The firmware's cascaded PID: position and velocity at 100 Hz, attitude and rate at 500 Hz.

Structure and default gains as in crazyflie-firmware 2026.08 (controller_pid,
position_controller_pid, attitude_pid_controller, power_distribution_quadrotor,
platform_defaults_cf2), written anew; angles in degrees and motor commands in PWM units,
as there. Roll and pitch here are right-handed about x and y (pitch is nose down positive).
"""

import math

from airtouch.simulation.compiled import jit

RATE, ANGLE, SPEED, PLACE = 0, 3, 6, 9  #: places of the loops in the memory
INTEGRAL, PREVIOUS, DESIRED, THRUST, SIZE = 0, 12, 24, 27, 28  #: blocks of the memory
MODE, X, Y, Z, VX, VY, YAW, MOTORS, SETPOINT_SIZE = range(9)  #: places in a set-point row
FLY, HOLD, TILT, TILT_THRUST = 0.0, 1.0, 2.0, 3.0  #: values of MODE, see position_loop
POSITION_STEPS = 5  #: physics steps a run of the position controller


@jit
def limit(value, bound):
    """value held within -bound..bound."""
    return min(max(value, -bound), bound)


@jit
def pid(memory, at, error, kp, ki, h, integral_limit):
    """Proportional and integral part of loop `at`; its integral is kept in memory."""
    memory[INTEGRAL + at] = limit(memory[INTEGRAL + at] + error * h, integral_limit)
    return kp * error + ki * memory[INTEGRAL + at]


@jit
def reset(memory, yaw_deg):
    """Forget everything; hold the present heading."""
    for i in range(SIZE):
        memory[i] = 0.0
    memory[DESIRED + 2] = yaw_deg


@jit
def position_loop(plant, memory, setpoint, place, velocity, yaw):
    """100 Hz: desired roll, pitch (degrees) and thrust (PWM) into memory.

    setpoint: one row. MODE HOLD: hold x, y; FLY: fly vx, vy, world axes; TILT: vx, vy are roll
    and pitch in degrees; TILT_THRUST: so, and z is the thrust, PWM. place, velocity (3,):
    estimates, world axes. yaw in rad.
    """
    h = POSITION_STEPS * plant.step
    memory[DESIRED + 2] = math.degrees(setpoint[YAW])
    if setpoint[MODE] < 1.5:
        _tilt(plant, memory, setpoint, place, velocity, yaw, h)
    else:
        memory[DESIRED], memory[DESIRED + 1] = setpoint[VX], setpoint[VY]
    if setpoint[MODE] > 2.5:
        memory[THRUST] = setpoint[Z]
        return
    k = plant.height_gain
    climb = limit(pid(memory, PLACE + 2, setpoint[Z] - place[2], 2.0 * k, 0.5 * k, h, 5000.0), 1.1)
    lift = limit(pid(memory, SPEED + 2, climb - velocity[2], 25.0 * k, 15.0 * k, h, 5000.0), 32.767)
    thrust = lift * plant.thrust_scale + plant.thrust_base
    memory[THRUST] = min(max(thrust, plant.thrust_min), 65535.0)


@jit
def _tilt(plant, memory, setpoint, place, velocity, yaw, h):
    """Desired roll and pitch that hold a place or fly a velocity."""
    c, s = math.cos(yaw), math.sin(yaw)
    k = plant.position_gain
    if setpoint[MODE] > 0.5:
        ex, ey = setpoint[X] - place[0], setpoint[Y] - place[1]
        want_x = limit(pid(memory, PLACE, c * ex + s * ey, 2.0 * k, 0.0, h, 5000.0), 1.1)
        want_y = limit(pid(memory, PLACE + 1, c * ey - s * ex, 2.0 * k, 0.0, h, 5000.0), 1.1)
    else:
        want_x = c * setpoint[VX] + s * setpoint[VY]
        want_y = c * setpoint[VY] - s * setpoint[VX]
    ahead, left = c * velocity[0] + s * velocity[1], c * velocity[1] - s * velocity[0]
    pitch = pid(memory, SPEED, want_x - ahead, 25.0 * k, 1.0 * k, h, 5000.0)
    roll = -pid(memory, SPEED + 1, want_y - left, 25.0 * k, 1.0 * k, h, 5000.0)
    memory[DESIRED] = limit(roll, plant.tilt_limit)
    memory[DESIRED + 1] = limit(pitch, plant.tilt_limit)


@jit
def attitude_loop(plant, memory, roll, pitch, yaw, rates, pwm):
    """500 Hz: from angles (rad) and rates (3,) (rad/s) to the PWM (4,) of the motors."""
    h = plant.step
    degrees = 57.29577951308232
    k = plant.attitude_gain
    turn = memory[DESIRED + 2] - yaw * degrees
    turn -= 360.0 * math.floor((turn + 180.0) / 360.0)
    want_x = pid(memory, ANGLE, memory[DESIRED] - roll * degrees, 6.0 * k, 3.0 * k, h, 20.0)
    want_y = pid(memory, ANGLE + 1, memory[DESIRED + 1] - pitch * degrees, 6.0 * k, 3.0 * k, h, 20.0)
    want_z = pid(memory, ANGLE + 2, turn, 6.0 * k, 1.0 * k, h, 360.0)
    want_z -= 0.35 * k * (yaw * degrees - memory[PREVIOUS + ANGLE + 2]) / h if memory[
        PREVIOUS + ANGLE + 2] != 0.0 and abs(yaw * degrees - memory[PREVIOUS + ANGLE + 2]) < 180.0 else 0.0
    memory[PREVIOUS + ANGLE + 2] = yaw * degrees
    k = plant.rate_gain * plant.rate_scale
    rx, ry, rz = rates[0] * degrees, rates[1] * degrees, rates[2] * degrees
    out_x = _rate(plant, memory, 0, want_x, rx, 250.0 * k, 500.0 * k, 2.5 * k, h, 33.3)
    out_y = _rate(plant, memory, 1, want_y, ry, 250.0 * k, 500.0 * k, 2.5 * k, h, 33.3)
    out_z = _rate(plant, memory, 2, want_z, rz, 120.0 * k, 16.7 * k, 0.0, h, 166.7)
    half_x, half_y = 0.5 * out_x, 0.5 * out_y
    base = memory[THRUST]
    pwm[0] = base - half_x - half_y - out_z
    pwm[1] = base - half_x + half_y + out_z
    pwm[2] = base + half_x + half_y - out_z
    pwm[3] = base + half_x - half_y + out_z


@jit
def _rate(plant, memory, at, want, rate, kp, ki, kd, h, integral_limit):
    error = want - rate
    out = pid(memory, RATE + at, error, kp, ki, h, integral_limit)
    source = error if plant.derivative_on_error > 0.5 else -rate
    out += kd * (source - memory[PREVIOUS + at]) / h
    memory[PREVIOUS + at] = source
    return limit(out, 32767.0)


@jit
def cap(pwm):
    """Cap as the firmware does: attitude goes before thrust; whole numbers 0..65535."""
    highest = max(max(pwm[0], pwm[1]), max(pwm[2], pwm[3]))
    reduction = max(highest - 65535.0, 0.0)
    for i in range(4):
        pwm[i] = math.floor(min(max(pwm[i] - reduction, 0.0), 65535.0))
