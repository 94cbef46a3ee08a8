"""PWM that gives a commanded thrust at the present battery voltage."""

import math
from typing import Any

import numpy as np

from airtouch.simulation.body import motors
from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware.mixer import MOST
from airtouch.simulation.firmware.settings import CUBIC, NO_COMPENSATION, OF_VEHICLE, QUADRATIC

COMMANDS, VOLTS = np.linspace(5000.0, 65000.0, 61), np.linspace(0.6, 4.4, 61)  #: where `slope` looks


@jit
def smoothed(settings, supply, volts):
    """The compensation's filtered voltage, one millisecond later."""
    return supply + settings.battery_compensation.voltage_share * (volts - supply)


@jit
def cubic_root(c, value):
    """The x at which the rising cubic c0 + c1 x + c2 x^2 + c3 x^3 has a value (Cardano)."""
    shift = c[2] / (3.0 * c[3])
    third = c[1] / (3.0 * c[3]) - shift * shift  # t^3 + 3 third t + 2 half = 0, x = t - shift
    half = shift * shift * shift - 0.5 * shift * c[1] / c[3] + 0.5 * (c[0] - value) / c[3]
    root = math.sqrt(half * half + third * third * third)
    return np.cbrt(root - half) - np.cbrt(root + half) - shift


@jit
def compensate(settings, plant, volts, command):
    """PWM for one motor's command (both of 65535, not yet capped) at `volts` of the battery."""
    s = settings.battery_compensation
    if s.kind == NO_COMPENSATION:
        return command
    if volts < s.least_v:
        return 0.0
    if s.kind == OF_VEHICLE:
        return motors.compensated(plant, command, motors.voltage_factor(plant, volts))
    if s.kind == QUADRATIC:
        grams = command / (MOST + 1.0) * s.most_g
        needed = (s.volts_of_grams[0] + s.volts_of_grams[1] * grams) * grams
    else:
        thrust = command / MOST * s.most_n
        if thrust < s.least_n:
            return 0.0
        needed = cubic_root(s.newtons_of_volts, thrust)
    return float(int(MOST * needed / volts))


@jit
def apply(settings, plant, volts, commands):
    """`compensate` on four motors (4,) in place."""
    if settings.battery_compensation.kind != NO_COMPENSATION:
        for i in range(4):
            commands[i] = compensate(settings, plant, volts, commands[i])


def slope(settings: Any, plant: Any, pwm: float) -> float:
    """PWM that one more count of a motor's command gives at the nominal voltage, where the PWM is `pwm`."""
    s = settings["battery_compensation"]
    if s["kind"] == QUADRATIC:
        grams = COMMANDS / (MOST + 1.0) * s["most_g"]
        commands, volts = COMMANDS, (s["volts_of_grams"][0] + s["volts_of_grams"][1] * grams) * grams
    elif s["kind"] == CUBIC:
        commands, volts = np.polyval(s["newtons_of_volts"][::-1], VOLTS) / s["most_n"] * MOST, VOLTS
    else:
        return 1.0
    out = MOST * volts / float(plant["nominal_voltage"])
    return float(np.interp(pwm, out, np.gradient(out, commands)))


__all__ = ["CUBIC", "apply", "compensate", "cubic_root", "slope", "smoothed"]
