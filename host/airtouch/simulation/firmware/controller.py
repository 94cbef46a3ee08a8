"""The cascaded PID controller: position, velocity, attitude, rate.

Angles in degrees and commands in counts of 65535, as the firmware has them; its roll is right-handed
about x, its pitch is nose up ("legacy"), its yaw is right-handed about z.
"""

import math

import numpy as np

from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware import mixer, pid
from airtouch.simulation.firmware import settings as of

_F, _I = np.float64, np.int64
DISABLED, ABSOLUTE, VELOCITY = 0, 1, 2  #: modes of a set-point's axes
X, Y, Z, ROLL, PITCH, YAW = range(6)  #: places of the modes
#: position m, velocity m/s (body-yaw axes where velocity_body is 1, else world), attitude deg, rates deg/s
SETPOINT = np.dtype([("mode", _I, (6,)), ("velocity_body", _I), ("position", _F, (3,)), ("velocity", _F, (3,)),
                     ("attitude", _F, (3,)), ("rate", _F, (3,)), ("thrust", _F)])
#: what the loops keep, and what they ask for: attitude, rates, thrust; commands of roll, pitch, yaw
STATE = np.dtype([("loops", pid.STATE, (12,)), ("mode", _I, (6,)), ("attitude", _F, (3,)), ("rate", _F, (3,)),
                  ("thrust", _F), ("command", _F, (3,))])


@jit
def reset(state, position, attitude):
    """Reset every loop at the present position (3,) and attitude (3,), deg."""
    for i in range(12):
        pid.reset(state.loops[i], 0.0)
    for i in range(3):
        pid.reset(state.loops[of.POSITION_X + i], position[i])
        pid.reset(state.loops[of.ROLL + i], attitude[i])
    state.attitude[0], state.attitude[1] = attitude[0], attitude[1]


@jit
def run(settings, plant, state, setpoint, tick, position, velocity, attitude, gyro):
    """One call at a tick (ms) at which the attitude loop is due.

    position (3,) m, velocity (3,) m/s: world axes; attitude (3,) deg; gyro (3,) deg/s, body axes. plant: its
    gains scale the loops. Results are in state: thrust, command.
    """
    changed = False
    for i in range(6):
        changed = changed or state.mode[i] != setpoint.mode[i]
        state.mode[i] = setpoint.mode[i]
    if changed and settings.controller.reset_on_mode_change:
        reset_at(settings, state, position, attitude)
    dt = 0.001 * settings.periods.attitude_ms
    _heading(state, setpoint, dt)
    if tick % settings.periods.position_ms == 0:
        _position(settings, plant, state, setpoint, position, velocity, attitude)
    if setpoint.mode[Z] == DISABLED:
        state.thrust = setpoint.thrust
    if setpoint.mode[X] == DISABLED or setpoint.mode[Y] == DISABLED:
        state.attitude[0], state.attitude[1] = setpoint.attitude[0], setpoint.attitude[1]
    _attitude(settings, plant, state, setpoint, attitude, gyro, dt)
    if state.thrust == 0.0:
        state.command[0], state.command[1], state.command[2] = 0.0, 0.0, 0.0
        reset_at(settings, state, position, attitude)
        state.attitude[2] = attitude[2]


@jit
def reset_at(settings, state, position, attitude):
    """`reset` as the release does it: with the derivative on the error, errors start at 0."""
    reset(state, position, attitude)
    if settings.controller.derivative_on_error:
        for i in range(12):
            state.loops[i].previous = 0.0


@jit
def _heading(state, setpoint, dt):
    if setpoint.mode[YAW] == VELOCITY:
        state.attitude[2] += setpoint.rate[2] * dt
    elif setpoint.mode[YAW] == ABSOLUTE:
        state.attitude[2] = setpoint.attitude[2]
    state.attitude[2] -= 360.0 * math.floor((state.attitude[2] + 180.0) / 360.0)


@jit
def _position(settings, plant, state, setpoint, position, velocity, attitude):
    """Position and velocity loops: desired roll, pitch and thrust."""
    s = settings.controller
    dt, on_error = 0.001 * settings.periods.position_ms, s.derivative_on_error
    yaw = math.radians(attitude[2])
    c, n = math.cos(yaw), math.sin(yaw)
    loops, gains, level, upright = state.loops, settings.loops, plant.position_gain, plant.height_gain
    p, v, w = setpoint.position, setpoint.velocity, velocity
    ahead, left = v[0], v[1]
    if not setpoint.velocity_body:
        ahead, left = c * v[0] + n * v[1], c * v[1] - n * v[0]
    climb = v[2]
    if setpoint.mode[X] == ABSOLUTE:
        ahead = pid.run(gains[of.POSITION_X], loops[of.POSITION_X], level, c * p[0] + n * p[1],
                        c * position[0] + n * position[1], dt, on_error, False)
    if setpoint.mode[Y] == ABSOLUTE:
        left = pid.run(gains[of.POSITION_Y], loops[of.POSITION_Y], level, c * p[1] - n * p[0],
                       c * position[1] - n * position[0], dt, on_error, False)
    if setpoint.mode[Z] == ABSOLUTE:
        climb = pid.run(gains[of.POSITION_Z], loops[of.POSITION_Z], upright, p[2], position[2], dt, on_error, False)
    pitch = -pid.run(gains[of.VELOCITY_X], loops[of.VELOCITY_X], level, ahead, c * w[0] + n * w[1], dt, on_error, False)
    roll = -pid.run(gains[of.VELOCITY_Y], loops[of.VELOCITY_Y], level, left, c * w[1] - n * w[0], dt, on_error, False)
    state.attitude[0] = pid.limit(roll, s.tilt_limit_deg)
    state.attitude[1] = pid.limit(pitch, s.tilt_limit_deg)
    lift = pid.run(gains[of.VELOCITY_Z], loops[of.VELOCITY_Z], upright, climb, w[2], dt, on_error, False)
    state.thrust = min(max(lift * plant.thrust_scale + plant.thrust_base, plant.thrust_min), mixer.MOST)


@jit
def _attitude(settings, plant, state, setpoint, attitude, gyro, dt):
    """Attitude and rate loops: desired rates and commands."""
    on_error = settings.controller.derivative_on_error
    loops, gains, rate = state.loops, settings.loops, state.rate
    scale = plant.rate_gain * plant.rate_scale
    for i in range(3):
        rate[i] = pid.run(gains[of.ROLL + i], loops[of.ROLL + i], plant.attitude_gain, state.attitude[i],
                          attitude[i], dt, on_error, i == 2)
        if i < 2 and setpoint.mode[ROLL + i] == VELOCITY:
            rate[i] = setpoint.rate[i]
            if settings.controller.reset_in_rate_mode:
                pid.reset(loops[of.ROLL + i], 0.0)
    for i in range(3):
        measured = -gyro[1] if i == 1 else gyro[i]
        out = pid.run(gains[of.RATE_ROLL + i], loops[of.RATE_ROLL + i], scale, rate[i], measured, dt, on_error, False)
        state.command[i] = mixer.whole(out)
    state.command[2] = -state.command[2]
