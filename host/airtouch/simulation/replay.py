"""Recorded motor commands through the same motors, rigid body and effects as in flight.

Left out are the plant's motor_slowness and motor_dead_zone, which only effects of a user's own set, motor noise, and
the accelerometer's distance from the centre of mass: the specific force is that of the centre of mass.

Nothing is integrated but what the motors and the effects remember: attitude, velocity
and height come from the log where it has them. The diagnosis compares the result with
what the IMU measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import float64, njit, types

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import ACC, ATTITUDE, GYRO, POSITION, PWM, VELOCITY, FlightLog
from airtouch.reference.finite import hold_finite
from airtouch.simulation import signals as at
from airtouch.simulation.body import battery, motors, rigid_body
from airtouch.simulation.body.rotation import as_matrix
from airtouch.simulation.effects import Active, slots
from airtouch.simulation.effects.effect import MEMORY
from airtouch.simulation.effects.slots import EFFECT_SLOTS, SLOTS
from airtouch.simulation.flight import prepare
from airtouch.simulation.plant import PLANT, hover_speed
from airtouch.simulation.random_generator import generator
from airtouch.simulation.sensors import filters
from airtouch.simulation.stepper import keys
from airtouch.vehicle import Vehicle

FAR_M = 10.0  #: height where none is known: out of ground effect


@dataclass(frozen=True)
class Replay:
    """What the model says of each of n samples.

    specific_force (n, 3) m/s^2, torque (n, 3) N m and angular_acceleration (n, 3) rad/s^2: body axes;
    rotor_speed (n, 4) rad/s; volts (n,).
    """

    specific_force: np.ndarray
    torque: np.ndarray
    angular_acceleration: np.ndarray
    rotor_speed: np.ndarray
    volts: np.ndarray


class _Log(NamedTuple):
    """What the replay reads of n samples: signals (n, COUNT), pwm (n, 4), measured volts (n,; NaN: none)."""

    signals: np.ndarray
    pwm: np.ndarray
    volts: np.ndarray


class _Model(NamedTuple):
    """What it fills.

    force over mass and torque (n, 6), angular acceleration (n, 3), rotor speeds (n, 4) rad/s, supply volts (n,).
    """

    motion: np.ndarray
    turning: np.ndarray
    speeds: np.ndarray
    volts: np.ndarray


@njit
def _motion(plant, speed, force, out):
    """Specific force and torque (6,) of rotors and effects, without the rotors' momentum."""
    lift, roll, pitch, yaw = rigid_body.rotor_wrench(plant, speed, plant.gain)
    out[0], out[1], out[2] = force[0] / plant.mass, force[1] / plant.mass, (force[2] + lift) / plant.mass
    out[3], out[4], out[5] = force[3] + roll, force[4] + pitch, force[5] + yaw


@njit
def _rotors(plant, s, speed, target, left, out):
    """Rotor speeds one sample on, and the torque of their momentum and its change, added to out (6,).

    left: share of a difference in speed after one sample, of a rotor that speeds up and of one that slows down.
    """
    spin, spin_rate = 0.0, 0.0
    for i in range(4):
        rises = target[i] > speed[i]
        tau = plant.motor_rise if rises else plant.motor_fall
        spin += rigid_body.SPIN[i] * plant.rotor_inertia * speed[i]
        spin_rate += rigid_body.SPIN[i] * plant.rotor_inertia * (target[i] - speed[i]) / tau
        speed[i] = target[i] + (speed[i] - target[i]) * (left[0] if rises else left[1])
    out[3] -= s[at.RATES + 1] * spin
    out[4] += s[at.RATES] * spin
    out[5] -= spin_rate


@njit
def _power(plant, speed):
    """Electrical power of four rotors at speeds (4,), W."""
    power = 0.0
    for i in range(4):
        thrust = plant.thrust_per_speed2 * speed[i] * speed[i]
        power += plant.power_per_thrust15 * thrust * np.sqrt(thrust)
    return power


_ROWS, _COLUMN = float64[:, ::1], float64[::1]


@njit
def _turning(plant, s, torque, out):
    """Angular acceleration (3,) under a torque (3,) on a turning body: Euler's equations."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        gyroscopic = (s[at.RATES + j] * (plant.inertia[k] * s[at.RATES + k])
                      - s[at.RATES + k] * (plant.inertia[j] * s[at.RATES + j]))
        out[i] = (torque[i] - gyroscopic) / plant.inertia[i]


@njit(types.void(PLANT, types.NamedTuple((_ROWS, _ROWS, _COLUMN), _Log), EFFECT_SLOTS,
                 types.NamedTuple((_ROWS, _ROWS, _ROWS, _COLUMN), _Model)), cache=True, nogil=True)
def _run(plants, log, effects, model):
    """Fill the model, sample by sample, and rotor speeds and thrusts of the signals."""
    plant = plants[0]
    speed, target = np.zeros(4), np.zeros(4)
    commands, memory, force = np.zeros((motors.DELAY_ROWS, 4)), np.zeros((SLOTS, MEMORY)), np.zeros(6)
    charge, battery_volts = plant.battery_charge, plant.nominal_voltage
    commands[:] = log.pwm[0]
    for i in range(4):
        speed[i] = motors.target_speed(plant, log.pwm[0, i], 1.0)
    before, left = -1.0, (0.0, 0.0)
    for k in range(len(log.signals)):
        s = log.signals[k]
        h = s[at.STEP]
        if h != before:
            before, left = h, (np.exp(-h / plant.motor_rise), np.exp(-h / plant.motor_fall))
        volts = battery.supply(plant, battery_volts)
        if np.isfinite(log.volts[k]):
            volts = log.volts[k]
        model.volts[k], model.speeds[k] = volts, speed
        factor = motors.voltage_factor(plant, volts)
        if plant.battery_strength != 0.0:
            charge, battery_volts = battery.drain(plant, charge, _power(plant, speed), h)
        for i in range(4):
            thrust = plant.thrust_per_speed2 * speed[i] * speed[i]
            s[at.ROTOR_SPEED + i], s[at.THRUST + i] = speed[i], thrust * plant.gain[i]
            commands[k % motors.DELAY_ROWS, i] = log.pwm[k, i]
            target[i] = motors.target_speed(plant, filters.delayed(commands, k, plant.actuator_delay / h, i), factor)
        force[:] = 0.0
        slots.add(effects, s, memory, force)
        _motion(plant, speed, force, model.motion[k])
        _rotors(plant, s, speed, target, left, model.motion[k])
        _turning(plant, s, model.motion[k, 3:], model.turning[k])


def signals_of(log: FlightLog, vehicle: Vehicle, active: Sequence[Active] = (),
               period_s: float = 0.01) -> np.ndarray:
    """The signals (n, COUNT) that effects see, from what a log holds.

    Where it has no attitude the vehicle is taken as level, without velocity as standing,
    without a down range as far from any surface.
    """
    plant, _ = prepare(vehicle, active)
    row, n = plant[0], len(log)
    s = np.zeros((n, at.COUNT))
    s[:, at.TIME], s[:, at.STEP] = np.arange(n) * period_s, period_s
    s[:, at.MASS], s[:, at.GRAVITY] = row["mass"], row["gravity"]
    s[:, at.ROTOR_X:at.ROTOR_X + 4] = row["rotor_x"] - row["com"][0]
    s[:, at.ROTOR_Y:at.ROTOR_Y + 4] = row["rotor_y"] - row["com"][1]
    s[:, at.ROTOR_RADIUS], s[:, at.ROTOR_SPACING] = row["rotor_radius"], row["rotor_spacing"]
    s[:, at.HOVER_SPEED] = hover_speed(plant)
    turn = as_matrix(*(log[c] for c in ATTITUDE)) if log.has(*ATTITUDE) else np.tile(np.eye(3), (n, 1, 1))
    s[:, at.ROTATION:at.ROTATION + 9] = turn.reshape(n, 9)
    if log.has(*VELOCITY):
        s[:, at.VELOCITY:at.VELOCITY + 3] = np.einsum("nji,nj->ni", turn, log.stack(VELOCITY))
    for i, name in enumerate(POSITION):
        s[:, at.POSITION + i] = np.nan_to_num(log[name]) if log.has(name) else 0.0
    if log.has(*GYRO):
        s[:, at.RATES:at.RATES + 3] = log.stack(GYRO)
    if log.has(*ACC):
        s[:, at.ACCELERATION:at.ACCELERATION + 3] = np.einsum("nij,nj->ni", turn, log.stack(ACC))
        s[:, at.ACCELERATION + 2] -= row["gravity"]
    height = log["zrange_m"] + row["range_below_rotors"] if log.has("zrange_m") else np.full(n, np.nan)
    height = np.where(np.isfinite(height), height, FAR_M)
    tilt = np.einsum("ni,ij->nj", turn[:, 2, :2], np.stack([row["rotor_x"], row["rotor_y"]]))
    for place in (at.LOWER_HEIGHT, at.UPPER_HEIGHT):
        s[:, place:place + 4] = height[:, None] + tilt
    for place in (at.LOWER_FACTOR, at.UPPER_FACTOR, at.LOWER_ROUGHNESS, at.UPPER_ROUGHNESS):
        s[:, place:place + 4] = 1.0
    s[:, at.HEIGHT] = height
    return s


def run(log: FlightLog, vehicle: Vehicle, active: Sequence[Active] = (), *, period_s: float = 0.01,
        signals: np.ndarray | None = None, pwm: np.ndarray | None = None, seed: int = 0) -> Replay:
    """Replay a log's motor commands through a vehicle with effects switched on.

    signals: (n, COUNT) where more is known than `signals_of` finds in the log; its rotor speeds and thrusts are
    overwritten, so hand in a copy. pwm: (n, 4) instead of the log's own. A command or voltage that is not finite
    holds the one before, at the start the first that is. A logged battery voltage is used where the vehicle declares
    the voltage of its thrust curve. Random parts of effects are drawn from `seed`. Raises AirTouchError without motor
    commands, and for an actuator delay longer than the delay line.
    """
    log.require(*PWM)
    plant, acting = prepare(vehicle, active)
    s = np.ascontiguousarray(signals_of(log, vehicle, active, period_s) if signals is None else signals)
    n = len(s)
    longest_s = (motors.DELAY_ROWS - 1) * s[:, at.STEP].min(initial=np.inf)
    if plant[0]["actuator_delay"] > longest_s:
        raise AirTouchError(f"actuator_delay = {plant[0]['actuator_delay']:g} s is longer than a replay at this rate "
                            f"can hold; give at most {longest_s:g} s")
    volts = np.full(n, np.nan)
    if vehicle.nominal_voltage_v is not None and log.has("vbat_V"):
        volts = _held(log["vbat_V"])
    effects = slots.slots(acting, [generator(seed, 0, key) for key in keys(acting, first="")])
    model = _Model(np.zeros((n, 6)), np.zeros((n, 3)), np.zeros((n, 4)), np.zeros(n))
    commands = np.ascontiguousarray(log.stack(PWM) if pwm is None else pwm, float)
    if not np.isfinite(commands).all():
        commands = np.nan_to_num(_held(commands))  # a motor without any command is off
    _run(plant, _Log(s, commands, volts), effects, model)
    force, torque = model.motion[:, :3] + plant[0]["acc_bias"], model.motion[:, 3:]
    return Replay(force, torque, model.turning, model.speeds, model.volts)


def _held(values: np.ndarray) -> np.ndarray:
    """`hold_finite` of values (n,) or (n, c), from their first finite one on; NaN where there is none."""
    if np.isfinite(values).all():
        return np.array(values, float)
    first = np.take_along_axis(values, np.isfinite(values).argmax(axis=0)[None], axis=0)[0]
    return hold_finite(values, initial=np.where(np.isfinite(first), first, np.nan))[0]


def wrench_of(active: Active, signals: np.ndarray, seed: int = 0) -> np.ndarray:
    """Force and torque (n, 6), N and N m in body axes, of one effect on given signals (n, COUNT)."""
    out, memory = np.zeros((len(signals), 6)), np.zeros(MEMORY)
    rng = generator(seed, 0, active.effect.name)
    parameters = active.effect.vector(active.values)
    for k in range(len(signals)):
        active.effect.wrench(parameters, signals[k], memory, rng, out[k])
    return out
