"""Six degrees of freedom with spinning rotors: equations of motion and their RK4 step.

State (13,): position (m, world), velocity (m/s, world), quaternion (w first), rates
(rad/s, body). Rotor speeds follow their command with a first-order lag and are solved
exactly; their thrust enters each stage of the step at its own time. The wrench of the
effects is given at the middle of the step and held.
"""

import math

from airtouch.simulation.compiled import jit
from airtouch.simulation.rotation import normalise, rotate

POSITION, VELOCITY, ATTITUDE, RATES = 0, 3, 6, 10  #: places in the state
STATE_SIZE = 13
SPIN = (1.0, -1.0, 1.0, -1.0)  #: of rotors 1..4 about +z; the reaction on the body is opposite


@jit
def thrust_wrench(plant, speed, out):
    """Body force z and torques of four rotors at `speed` (rad/s) into out (4,): N, N m."""
    out[0], out[1], out[2], out[3] = _wrench(plant, (speed[0], speed[1], speed[2], speed[3]))


@jit
def constants(plant, h):
    """What `advance` needs of a plant whose mass, inertia and motor lags stay as they are, for steps of h s.

    1 / mass, 1 / moments of inertia, share of the way left to a rotor half a step on when it speeds up
    and when it slows down, 1 / both lags.
    """
    rise, fall = 1.0 / plant.motor_rise, 1.0 / plant.motor_fall
    return (1.0 / plant.mass, 1.0 / plant.inertia[0], 1.0 / plant.inertia[1], 1.0 / plant.inertia[2],
            math.exp(-0.5 * h * rise), math.exp(-0.5 * h * fall), rise, fall)


@jit
def derivative(plant, state, wrench, spin, spin_rate, force, out):
    """dstate/dt into out (13,).

    wrench (4,): thrust and torques of the rotors. force (6,): force and torque of the
    effects, body axes. spin: net angular momentum of the rotors about z (kg m^2/s);
    spin_rate: its rate of change (N m).
    """
    slope = _slope(plant, constants(plant, 0.0), _numbers(state), (wrench[0], wrench[1], wrench[2], wrench[3]),
                   spin, spin_rate, force)
    _put(out, slope)


@jit
def step(plant, state, speed, target, h, force, slope):
    """Advance state (13,) and rotor speeds (4,) by h seconds, in place.

    target (4,): speed towards which each rotor tends, rad/s. slope (13,) holds dstate/dt at
    the start on return.
    """
    advance(plant, constants(plant, h), state, speed, target, h, force, slope)


@jit
def advance(plant, constant, state, speed, target, h, force, slope):
    """`step` with the plant's `constants` at hand.

    Tuples, not arrays: numbers stay in registers.
    """
    rise_half, fall_half = constant[4], constant[5]
    start = _numbers(state)
    now = _rotors(plant, constant, speed, target, 1.0, 1.0)
    k1 = _slope(plant, constant, start, _wrench(plant, now[0]), now[1], now[2], force)
    now = _rotors(plant, constant, speed, target, rise_half, fall_half)
    wrench = _wrench(plant, now[0])
    k2 = _slope(plant, constant, _along(start, 0.5 * h, k1), wrench, now[1], now[2], force)
    k3 = _slope(plant, constant, _along(start, 0.5 * h, k2), wrench, now[1], now[2], force)
    now = _rotors(plant, constant, speed, target, rise_half * rise_half, fall_half * fall_half)
    k4 = _slope(plant, constant, _along(start, h, k3), _wrench(plant, now[0]), now[1], now[2], force)
    _put(slope, k1)
    _put(state, _along(start, h / 6.0, _along(_along(k1, 2.0, _along(k2, 1.0, k3)), 1.0, k4)))
    for i in range(4):
        speed[i] = now[0][i]
    normalise(state[6:10])


@jit
def _wrench(plant, speed):
    k, x, y, arm = plant.thrust_per_speed2, plant.com[0], plant.com[1], plant.yaw_torque_over_thrust
    a = k * speed[0] * speed[0] * plant.gain[0]
    b = k * speed[1] * speed[1] * plant.gain[1]
    c = k * speed[2] * speed[2] * plant.gain[2]
    d = k * speed[3] * speed[3] * plant.gain[3]
    return (a + b + c + d,
            (plant.rotor_y[0] - y) * a + (plant.rotor_y[1] - y) * b + (plant.rotor_y[2] - y) * c
            + (plant.rotor_y[3] - y) * d,
            -(plant.rotor_x[0] - x) * a - (plant.rotor_x[1] - x) * b - (plant.rotor_x[2] - x) * c
            - (plant.rotor_x[3] - x) * d,
            -arm * (SPIN[0] * a + SPIN[1] * b + SPIN[2] * c + SPIN[3] * d))


@jit
def _rotors(plant, constant, speed, target, rise_left, fall_left):
    """Four rotor speeds once a share of the way is left; their net angular momentum and its rate."""
    a, da = _rotor(constant, speed[0], target[0], rise_left, fall_left)
    b, db = _rotor(constant, speed[1], target[1], rise_left, fall_left)
    c, dc = _rotor(constant, speed[2], target[2], rise_left, fall_left)
    d, dd = _rotor(constant, speed[3], target[3], rise_left, fall_left)
    return ((a, b, c, d), plant.rotor_inertia * (SPIN[0] * a + SPIN[1] * b + SPIN[2] * c + SPIN[3] * d),
            plant.rotor_inertia * (SPIN[0] * da + SPIN[1] * db + SPIN[2] * dc + SPIN[3] * dd))


@jit
def _rotor(constant, speed, target, rise_left, fall_left):
    rising = target > speed
    now = target + (speed - target) * (rise_left if rising else fall_left)
    return now, (target - now) * (constant[6] if rising else constant[7])


@jit
def _slope(plant, constant, x, wrench, spin, spin_rate, force):
    q = (x[6], x[7], x[8], x[9])
    wx, wy, wz = x[10], x[11], x[12]
    m = constant[0]
    ax, ay, az = rotate(q, force[0] * m, force[1] * m, (force[2] + wrench[0]) * m)
    jx, jy, jz = plant.inertia[0], plant.inertia[1], plant.inertia[2]
    # J dw/dt = torque - w x (J w + h e_z) - dh/dt e_z, h: angular momentum of the rotors
    return (x[3], x[4], x[5], ax, ay, az - plant.gravity,
            0.5 * (-q[1] * wx - q[2] * wy - q[3] * wz), 0.5 * (q[0] * wx + q[2] * wz - q[3] * wy),
            0.5 * (q[0] * wy - q[1] * wz + q[3] * wx), 0.5 * (q[0] * wz + q[1] * wy - q[2] * wx),
            (wrench[1] + force[3] - (jz - jy) * wy * wz - wy * spin) * constant[1],
            (wrench[2] + force[4] - (jx - jz) * wz * wx + wx * spin) * constant[2],
            (wrench[3] + force[5] - (jy - jx) * wx * wy - spin_rate) * constant[3])


@jit
def _along(x, h, d):
    """x + h d of 13 numbers each."""
    return (x[0] + h * d[0], x[1] + h * d[1], x[2] + h * d[2], x[3] + h * d[3], x[4] + h * d[4],
            x[5] + h * d[5], x[6] + h * d[6], x[7] + h * d[7], x[8] + h * d[8], x[9] + h * d[9],
            x[10] + h * d[10], x[11] + h * d[11], x[12] + h * d[12])


@jit
def _numbers(x):
    return x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11], x[12]


@jit
def _put(out, x):
    for i in range(STATE_SIZE):
        out[i] = x[i]
