"""One PID loop as the firmware runs it: integral with a limit, derivative of measurement or error, output limit."""

import numpy as np

from airtouch.simulation.compiled import jit

STATE = np.dtype([("integral", np.float64), ("previous", np.float64)])


@jit
def limit(value, bound):
    """value held within -bound..bound."""
    return min(max(value, -bound), bound)


@jit
def wrapped(angle):
    """An angle beyond +-180 deg brought back by one turn."""
    if angle > 180.0:
        return angle - 360.0
    if angle < -180.0:
        return angle + 360.0
    return angle


@jit
def reset(state, measured):
    """Forget the integral; no derivative at the next run with the same measurement."""
    state.integral = 0.0
    state.previous = measured


@jit
def run(gains, state, scale, desired, measured, dt, on_error, turns):
    """The loop's output, dt seconds after its last run.

    gains: settings.GAINS; all are multiplied by scale. on_error: the derivative is the
    error's, else that of the measurement. turns: desired and measured are angles in degrees that wrap.
    """
    error = desired - measured
    if turns:
        error = wrapped(error)
    if on_error:
        change = error - state.previous
        state.previous = error
    else:
        change = state.previous - measured
        if turns:
            change = wrapped(change)
        state.previous = measured
    state.integral += error * dt
    if gains.integral_limit > 0.0:
        state.integral = limit(state.integral, gains.integral_limit)
    out = scale * (gains.p * error + gains.d * (change / dt) + gains.i * state.integral)
    if gains.output_limit > 0.0:
        out = limit(out, gains.output_limit)
    return out
