"""Six degrees of freedom with spinning rotors: equations of motion and their RK4 step.

State (13,): position (m, world), velocity (m/s, world), quaternion (w first), rates
(rad/s, body). Rotor speeds follow their command with a first-order lag and are solved
exactly; their thrust enters each stage of the step at its own time. The wrench of the
effects is given at the middle of the step and held.
"""

import math

from numba import njit

from airtouch.simulation.rotation import normalise, rotate

POSITION, VELOCITY, ATTITUDE, RATES = 0, 3, 6, 10  #: places in the state
STATE_SIZE = 13
SPIN = (1.0, -1.0, 1.0, -1.0)  #: of rotors 1..4 about +z; the reaction on the body is opposite


@njit(cache=True)
def thrust_wrench(plant, speed, out):
    """Body force z and torques of four rotors at `speed` (rad/s) into out (4,): N, N m."""
    out[0] = 0.0
    out[1] = 0.0
    out[2] = 0.0
    out[3] = 0.0
    for i in range(4):
        thrust = plant.thrust_per_speed2 * speed[i] * speed[i] * plant.gain[i]
        out[0] += thrust
        out[1] += (plant.rotor_y[i] - plant.com[1]) * thrust
        out[2] -= (plant.rotor_x[i] - plant.com[0]) * thrust
        out[3] -= SPIN[i] * plant.yaw_torque_over_thrust * thrust


@njit(cache=True)
def derivative(plant, state, q, wrench, spin, spin_rate, force, out):
    """dstate/dt into out (13,).

    q (4,): the quaternion within the state. wrench (4,): thrust and torques of the rotors.
    force (6,): force and torque of the effects, body axes. spin: net angular momentum of the
    rotors about z (kg m^2/s); spin_rate: its rate of change (N m).
    """
    m = plant.mass
    ax, ay, az = rotate(q, force[0] / m, force[1] / m, (force[2] + wrench[0]) / m)
    out[0], out[1], out[2] = state[3], state[4], state[5]
    out[3], out[4], out[5] = ax, ay, az - plant.gravity
    wx, wy, wz = state[10], state[11], state[12]
    out[6] = 0.5 * (-q[1] * wx - q[2] * wy - q[3] * wz)
    out[7] = 0.5 * (q[0] * wx + q[2] * wz - q[3] * wy)
    out[8] = 0.5 * (q[0] * wy - q[1] * wz + q[3] * wx)
    out[9] = 0.5 * (q[0] * wz + q[1] * wy - q[2] * wx)
    jx, jy, jz = plant.inertia[0], plant.inertia[1], plant.inertia[2]
    # J dw/dt = torque - w x (J w + h e_z) - dh/dt e_z, h: angular momentum of the rotors
    out[10] = (wrench[1] + force[3] - (jz - jy) * wy * wz - wy * spin) / jx
    out[11] = (wrench[2] + force[4] - (jx - jz) * wz * wx + wx * spin) / jy
    out[12] = (wrench[3] + force[5] - (jy - jx) * wx * wy - spin_rate) / jz


@njit(cache=True)
def step(plant, state, speed, target, h, force, work):
    """Advance state (13,) and rotor speeds (4,) by h seconds, in place.

    target (4,): speed towards which each rotor tends, rad/s. work (6, 13): scratch;
    row 0 holds dstate/dt at the start on return.
    """
    k1, k2, k3, k4, trial, aux = work[0], work[1], work[2], work[3], work[4], work[5]
    now, wrench = aux[0:4], aux[4:8]
    attitude, trial_attitude = state[6:10], trial[6:10]
    rise_half, fall_half = math.exp(-0.5 * h / plant.motor_rise), math.exp(-0.5 * h / plant.motor_fall)
    spin, spin_rate = _rotors_at(plant, speed, target, 1.0, 1.0, now)
    thrust_wrench(plant, now, wrench)
    derivative(plant, state, attitude, wrench, spin, spin_rate, force, k1)
    for i in range(STATE_SIZE):
        trial[i] = state[i] + 0.5 * h * k1[i]
    spin, spin_rate = _rotors_at(plant, speed, target, rise_half, fall_half, now)
    thrust_wrench(plant, now, wrench)
    derivative(plant, trial, trial_attitude, wrench, spin, spin_rate, force, k2)
    for i in range(STATE_SIZE):
        trial[i] = state[i] + 0.5 * h * k2[i]
    derivative(plant, trial, trial_attitude, wrench, spin, spin_rate, force, k3)
    for i in range(STATE_SIZE):
        trial[i] = state[i] + h * k3[i]
    spin, spin_rate = _rotors_at(plant, speed, target, rise_half * rise_half, fall_half * fall_half, now)
    thrust_wrench(plant, now, wrench)
    derivative(plant, trial, trial_attitude, wrench, spin, spin_rate, force, k4)
    for i in range(STATE_SIZE):
        state[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])
    for i in range(4):
        speed[i] = now[i]
    normalise(attitude)


@njit(cache=True)
def _rotors_at(plant, speed, target, rise, fall, out):
    """Rotor speeds into out (4,), once `rise` or `fall` of the way is left; their momentum and its rate."""
    momentum = 0.0
    rate = 0.0
    for i in range(4):
        rising = target[i] > speed[i]
        out[i] = target[i] + (speed[i] - target[i]) * (rise if rising else fall)
        momentum += SPIN[i] * out[i]
        rate += SPIN[i] * (target[i] - out[i]) / (plant.motor_rise if rising else plant.motor_fall)
    return plant.rotor_inertia * momentum, plant.rotor_inertia * rate
