"""Six degrees of freedom with spinning rotors: equations of motion and their RK4 step.

Rotor speeds follow their target with a first-order lag and are solved exactly; their thrust
enters each stage of the step at its own time. The wrench of effects and legs is given at the
middle of the step and held.
"""

import math
from typing import NamedTuple

import numpy as np

from airtouch.simulation.body.rotation import normalise, rotate
from airtouch.simulation.compiled import jit

_F = np.float64
POSITION, VELOCITY, ATTITUDE, RATES = 0, 3, 6, 10  #: places in the state
STATE_SIZE = 13
SPIN = (1.0, -1.0, 1.0, -1.0)  #: of rotors 1..4 about +z; the reaction on the body is opposite
BODY = np.dtype([
    ("state", _F, (STATE_SIZE,)),  # position m, velocity m/s (world), quaternion (w first), rates rad/s (body)
    ("slope", _F, (STATE_SIZE,)),  # d(state)/dt at the start of the last step
    ("rotor_speed", _F, (4,)),  # rad/s
    ("target_speed", _F, (4,)),  # rad/s, which the rotors tend to
    ("gain", _F, (4,)),  # thrust of each rotor over nominal, noise included
    ("wrench", _F, (6,)),  # force N and torque N m of effects and legs, body axes
])


class Constants(NamedTuple):
    """What `advance` needs of a plant whose mass, inertia and motor lags stay as they are."""

    per_mass: float  #: 1/kg
    per_inertia_x: float  #: 1/(kg m^2), about the principal axes
    per_inertia_y: float
    per_inertia_z: float
    rise_half: float  #: share of the way left to a rotor that speeds up, half a step on
    fall_half: float  #: and to one that slows down
    rise_rate: float  #: 1/s, 1 / lag of a rotor that speeds up
    fall_rate: float


class Rotors(NamedTuple):
    """Four rotors at one time."""

    speed: tuple  #: rad/s
    wrench: tuple  #: force along body z (N), torques about x, y, z (N m)
    spin: float  #: net angular momentum about z, kg m^2/s
    spin_rate: float  #: its rate of change, N m


@jit
def constants(plant):
    """The Constants of a plant, for steps of plant.step."""
    rise, fall = 1.0 / plant.motor_rise, 1.0 / plant.motor_fall
    return Constants(1.0 / plant.mass, 1.0 / plant.inertia[0], 1.0 / plant.inertia[1], 1.0 / plant.inertia[2],
                     math.exp(-0.5 * plant.step * rise), math.exp(-0.5 * plant.step * fall), rise, fall)


@jit
def rotor_wrench(plant, speed, gain):
    """Force along body z (N) and torques about x, y, z (N m) of four rotors at `speed` (4,) rad/s.

    gain (4,): thrust of each over nominal.
    """
    k, x, y, arm = plant.thrust_per_speed2, plant.com[0], plant.com[1], plant.yaw_torque_over_thrust
    a = k * speed[0] * speed[0] * gain[0]
    b = k * speed[1] * speed[1] * gain[1]
    c = k * speed[2] * speed[2] * gain[2]
    d = k * speed[3] * speed[3] * gain[3]
    return (a + b + c + d,
            (plant.rotor_y[0] - y) * a + (plant.rotor_y[1] - y) * b + (plant.rotor_y[2] - y) * c
            + (plant.rotor_y[3] - y) * d,
            -(plant.rotor_x[0] - x) * a - (plant.rotor_x[1] - x) * b - (plant.rotor_x[2] - x) * c
            - (plant.rotor_x[3] - x) * d,
            -arm * (SPIN[0] * a + SPIN[1] * b + SPIN[2] * c + SPIN[3] * d))


@jit
def derivative(plant, body):
    """Fill body.slope, the present d(state)/dt of a BODY."""
    fixed = constants(plant)
    rotors = _rotors(plant, fixed, body, 1.0, 1.0)
    _assign(body.slope, _slope(plant, fixed, _numbers(body.state), rotors, body.wrench))


@jit
def step(plant, body):
    """Advance a BODY by plant.step seconds in place: its state and rotor speeds. slope keeps its value at the start."""
    advance(plant, constants(plant), body)


@jit
def advance(plant, fixed, body):
    """`step` with the plant's Constants at hand.

    Tuples, not arrays: numbers stay in registers.
    """
    h, start = plant.step, _numbers(body.state)
    rotors = _rotors(plant, fixed, body, 1.0, 1.0)
    k1 = _slope(plant, fixed, start, rotors, body.wrench)
    rotors = _rotors(plant, fixed, body, fixed.rise_half, fixed.fall_half)
    k2 = _slope(plant, fixed, _along(start, 0.5 * h, k1), rotors, body.wrench)
    k3 = _slope(plant, fixed, _along(start, 0.5 * h, k2), rotors, body.wrench)
    rotors = _rotors(plant, fixed, body, fixed.rise_half * fixed.rise_half, fixed.fall_half * fixed.fall_half)
    k4 = _slope(plant, fixed, _along(start, h, k3), rotors, body.wrench)
    _assign(body.slope, k1)
    _assign(body.state, _along(start, h / 6.0, _along(_along(k1, 2.0, _along(k2, 1.0, k3)), 1.0, k4)))
    for i in range(4):
        body.rotor_speed[i] = rotors.speed[i]
    normalise(body.state[6:10])


@jit
def _rotors(plant, fixed, body, rise_left, fall_left):
    """Rotors of a BODY once a share of the way to their target is left: rise_left of those that speed up, fall_left
    of the others."""
    speed, target = body.rotor_speed, body.target_speed
    a, da = _rotor(fixed, speed[0], target[0], rise_left, fall_left)
    b, db = _rotor(fixed, speed[1], target[1], rise_left, fall_left)
    c, dc = _rotor(fixed, speed[2], target[2], rise_left, fall_left)
    d, dd = _rotor(fixed, speed[3], target[3], rise_left, fall_left)
    return Rotors((a, b, c, d), rotor_wrench(plant, (a, b, c, d), body.gain),
                  plant.rotor_inertia * (SPIN[0] * a + SPIN[1] * b + SPIN[2] * c + SPIN[3] * d),
                  plant.rotor_inertia * (SPIN[0] * da + SPIN[1] * db + SPIN[2] * dc + SPIN[3] * dd))


@jit
def _rotor(fixed, speed, target, rise_left, fall_left):
    """Speed (rad/s) and its rate (rad/s^2) of one rotor."""
    rising = target > speed
    now = target + (speed - target) * (rise_left if rising else fall_left)
    return now, (target - now) * (fixed.rise_rate if rising else fixed.fall_rate)


@jit
def _slope(plant, fixed, x, rotors, wrench):
    """d(state)/dt (13 numbers) at a state x under Rotors and the wrench of effects and legs."""
    lift, roll, pitch, yaw = rotors.wrench
    spin = rotors.spin
    q = (x[6], x[7], x[8], x[9])
    wx, wy, wz = x[10], x[11], x[12]
    m = fixed.per_mass
    ax, ay, az = rotate(q, wrench[0] * m, wrench[1] * m, (wrench[2] + lift) * m)
    jx, jy, jz = plant.inertia[0], plant.inertia[1], plant.inertia[2]
    # J dw/dt = torque - w x (J w + h e_z) - dh/dt e_z, h: angular momentum of the rotors
    return (x[3], x[4], x[5], ax, ay, az - plant.gravity,
            0.5 * (-q[1] * wx - q[2] * wy - q[3] * wz), 0.5 * (q[0] * wx + q[2] * wz - q[3] * wy),
            0.5 * (q[0] * wy - q[1] * wz + q[3] * wx), 0.5 * (q[0] * wz + q[1] * wy - q[2] * wx),
            (roll + wrench[3] - (jz - jy) * wy * wz - wy * spin) * fixed.per_inertia_x,
            (pitch + wrench[4] - (jx - jz) * wz * wx + wx * spin) * fixed.per_inertia_y,
            (yaw + wrench[5] - (jy - jx) * wx * wy - rotors.spin_rate) * fixed.per_inertia_z)


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
def _assign(out, x):
    for i in range(STATE_SIZE):
        out[i] = x[i]
