"""From PWM and supply voltage to the speed that a rotor tends to."""

import math

from airtouch.simulation.compiled import jit


@jit
def voltage_factor(plant, volts):
    """Thrust at `volts` over thrust at the nominal voltage, at one PWM."""
    ratio = volts / plant.nominal_voltage
    if plant.voltage_exponent == 2.0:
        return ratio * ratio
    return ratio ** plant.voltage_exponent


@jit
def target_speed(plant, pwm, factor):
    """Steady rotor speed in rad/s at a PWM of 0..65535; 0 where the motor is off."""
    if pwm <= 0.0:
        return 0.0
    c = plant.thrust_curve
    thrust = (c[0] + c[1] * pwm + c[2] * pwm * pwm) * factor
    return math.sqrt(max(thrust, 0.0) / plant.thrust_per_speed2)


@jit
def compensated(plant, pwm, factor):
    """PWM that gives at a voltage factor the thrust that `pwm` gives at the nominal voltage."""
    if pwm <= 0.0:
        return 0.0
    c = plant.thrust_curve
    thrust = (c[0] + c[1] * pwm + c[2] * pwm * pwm) / max(factor, 0.2)
    if c[2] == 0.0:
        return (thrust - c[0]) / c[1]
    return (-c[1] + math.sqrt(max(c[1] * c[1] - 4.0 * c[2] * (c[0] - thrust), 0.0))) / (2.0 * c[2])
