"""One PID loop as the firmware runs it: integral with a limit, derivative of measurement or error, output limit."""

from typing import NamedTuple

import numpy as np

from airtouch.simulation.compiled import jit

STATE = np.dtype([("integral", np.float64), ("previous", np.float64)])


class How(NamedTuple):
    """How a loop is run."""

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
def run(gains, state, how, desired, measured):
    """The loop's output.

    gains: settings.GAINS; state: STATE; how: How; desired and measured: in the loop's own unit.
    """
    error = desired - measured
    if how.turns:
        error = wrapped(error)
    if how.on_error:
        change = error - state.previous
        state.previous = error
    else:
        change = state.previous - measured
        if how.turns:
            change = wrapped(change)
        state.previous = measured
    state.integral += error * how.dt
    if gains.integral_limit > 0.0:
        state.integral = limit(state.integral, gains.integral_limit)
    out = how.scale * (gains.p * error + gains.d * (change / how.dt) + gains.i * state.integral)
    if gains.output_limit > 0.0:
        out = limit(out, gains.output_limit)
    return out
