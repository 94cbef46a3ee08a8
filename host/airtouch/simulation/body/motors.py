"""From motor commands to the speeds that the rotors tend to: delay, lag, dead zone, voltage, noise of the thrust."""

import math
from typing import NamedTuple

import numpy as np

from airtouch.simulation.body import battery
from airtouch.simulation.compiled import inlined, jit
from airtouch.simulation.random_generator import normals
from airtouch.simulation.sensors import filters

_F = np.float64
DELAY_ROWS = 64  #: of the delay line, a power of two: delays of up to 63 physics steps
LEAST_FACTOR = 0.2  #: voltage factor below which compensation asks for no more PWM; chosen, so that it stays finite
TURN = 2.0 * math.pi  #: rad
STATE = np.dtype([
    ("pwm", _F, (4,)),  # commands, 0..65535
    ("delay_line", _F, (DELAY_ROWS, 4)),  # the last of them, one row a step
    ("slow_command", _F, (4,)),  # commands after their own lag
    ("last_command", _F, (4,)),  # what a motor with a dead zone keeps to
    ("noise", _F, (8,)),  # slow (0..3) and fast (4..7) noise of the thrust, of rms 1
    ("phase", _F, (4,)),  # rad, of each rotor's turn
    ("normals", _F, (4,)),  # working space
])


class Noise(NamedTuple):
    """Of slow and fast noise of the thrust: share that is left a step later, and factor of what is drawn anew."""

    slow_left: float
    slow_fresh: float
    fast_left: float
    fast_fresh: float


@jit
def noise(plant):
    """The Noise of a plant, for steps of plant.step."""
    slow, fast = math.exp(-plant.step / plant.motor_noise_time), math.exp(-plant.step / plant.motor_hiss_time)
    return Noise(slow, math.sqrt(1.0 - slow * slow), fast, math.sqrt(1.0 - fast * fast))


@jit
def voltage_factor(plant, volts):
    """Thrust at `volts` over thrust at the nominal voltage, at one PWM."""
    ratio = volts / plant.nominal_voltage
    if plant.voltage_exponent == 2.0:
        return ratio * ratio
    return ratio ** plant.voltage_exponent


@jit
def target_speed(plant, pwm, factor):
    """Steady rotor speed in rad/s at a PWM of 0..65535 and a voltage factor; 0 where the motor is off."""
    if pwm <= 0.0:
        return 0.0
    c = plant.thrust_curve
    thrust = (c[0] + c[1] * pwm + c[2] * pwm * pwm) * factor
    return math.sqrt(max(thrust, 0.0) / plant.thrust_per_speed2)


@jit
def compensated(plant, pwm, factor):
    """PWM that has, at a voltage factor, the thrust of `pwm` at the nominal voltage."""
    if pwm <= 0.0:
        return 0.0
    c = plant.thrust_curve
    thrust = (c[0] + c[1] * pwm + c[2] * pwm * pwm) / max(factor, LEAST_FACTOR)
    if c[2] == 0.0:
        return (thrust - c[0]) / c[1]
    return (-c[1] + math.sqrt(max(c[1] * c[1] - 4.0 * c[2] * (c[0] - thrust), 0.0))) / (2.0 * c[2])


@jit
def drive(plant, state, shares, volts, generator):
    """The motors' stage of a physics step: target speeds and gains of the body's rotors, phases, battery.

    shares: Noise; volts: what the motors see; generator: random numbers of the motors.
    """
    s, body = state.motors, state.body
    _into_delay_line(s, state.step)
    _draw_noise(plant, s, shares, generator)
    factor, power = voltage_factor(plant, volts), 0.0
    power_per_speed3 = plant.power_per_thrust15 * plant.thrust_per_speed2 * math.sqrt(plant.thrust_per_speed2)
    for i in range(4):
        speed = body.rotor_speed[i]
        body.target_speed[i] = target_speed(plant, _command(plant, s, state.step, i), factor)
        random = plant.motor_noise * s.noise[i] + plant.motor_hiss * s.noise[4 + i]
        body.gain[i] = plant.gain[i] * (1.0 + random)
        power += power_per_speed3 * speed * speed * speed
        if plant.vibration > 0.0:
            turns = (s.phase[i] + plant.step * speed) / TURN
            s.phase[i] = TURN * (turns - math.floor(turns))
    state.battery.charge, state.battery.volts = battery.drain(plant, state.battery.charge, power, plant.step)


@jit
def _into_delay_line(s, k):
    """The present command into the delay line, at step k; at the first step as if it had always been so."""
    for i in range(4):
        s.delay_line[k & (DELAY_ROWS - 1), i] = s.pwm[i]
        if k == 0:
            for j in range(DELAY_ROWS):
                s.delay_line[j, i] = s.pwm[i]


@jit
def _draw_noise(plant, s, shares, generator):
    """Noise of the thrust one step on."""
    if plant.motor_hiss > 0.0:
        normals(generator, s.normals[:])
        for i in range(4):
            s.noise[4 + i] = shares.fast_left * s.noise[4 + i] + shares.fast_fresh * s.normals[i]
    normals(generator, s.normals[:])
    for i in range(4):
        s.noise[i] = shares.slow_left * s.noise[i] + shares.slow_fresh * s.normals[i]


@inlined
def _command(plant, s, k, i):
    """The command that reaches motor i at step k: delayed, slowed, and held within the dead zone."""
    command = filters.delayed(s.delay_line, k, plant.actuator_delay / plant.step, i)
    if plant.motor_slowness[i] > 0.0:
        s.slow_command[i] += (command - s.slow_command[i]) * (1.0 - math.exp(-plant.step / plant.motor_slowness[i]))
        command = s.slow_command[i]
    if plant.motor_dead_zone[i] > 0.0:
        if abs(command - s.last_command[i]) > plant.motor_dead_zone[i]:
            s.last_command[i] = command
        command = s.last_command[i]
    return command
