"""One PID loop as the firmware runs it: integral with a limit, derivative of measurement or error, output limit."""

from typing import NamedTuple

import numpy as np

from airtouch.simulation.compiled import jit

STATE = np.dtype([("integral", np.float64), ("previous", np.float64)])


class Options(NamedTuple):
    """What a loop is run with, beside its gains."""

    dt: float  #: s since its last run
    scale: float  #: all its gains are multiplied by it
    on_error: bool  #: the derivative is that of the error, else of the measurement
    turns: bool  #: desired and measured are angles in degrees that wrap


@jit
def limit(value, bound):
    """`value` limited to -bound..bound."""
    return min(max(value, -bound), bound)


@jit
def wrapped(angle):
    """An angle beyond +-180 deg, moved by one turn."""
    if angle > 180.0:
        return angle - 360.0
    if angle < -180.0:
        return angle + 360.0
    return angle


@jit
def reset(state, measured):
    """Clear the integral, and the derivative of the next run if the measurement does not change."""
    state.integral = 0.0
    state.previous = measured


@jit
def run(gains, state, options, desired, measured):
    """The loop's output.

    gains: settings.GAINS; state: STATE; options: Options; desired and measured: in the loop's own unit.
    """
    error = desired - measured
    if options.turns:
        error = wrapped(error)
    if options.on_error:
        change = error - state.previous
        state.previous = error
    else:
        change = state.previous - measured
        if options.turns:
            change = wrapped(change)
        state.previous = measured
    state.integral += error * options.dt
    if gains.integral_limit > 0.0:
        state.integral = limit(state.integral, gains.integral_limit)
    out = options.scale * (gains.p * error + gains.d * (change / options.dt) + gains.i * state.integral)
    if gains.output_limit > 0.0:
        out = limit(out, gains.output_limit)
    return out
