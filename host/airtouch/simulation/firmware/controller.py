"""The cascaded PID controller: position, velocity, attitude, rate.

Angles in degrees and commands in counts of 65535, as the firmware has them; its roll is right-handed
about x, its pitch is nose up ("legacy"), its yaw is right-handed about z.
"""

import math

import numpy as np

from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware import mixer, pid
from airtouch.simulation.firmware import settings as place

_F, _I = np.float64, np.int64
DISABLED, ABSOLUTE, VELOCITY = 0, 1, 2  #: modes of a set-point's axes
X, Y, Z, ROLL, PITCH, YAW = range(6)  #: places of the modes
#: position m, velocity m/s (body-yaw axes where velocity_body is 1, else world), attitude deg, rates deg/s
SETPOINT = np.dtype([("mode", _I, (6,)), ("velocity_body", _I), ("position", _F, (3,)), ("velocity", _F, (3,)),
                     ("attitude", _F, (3,)), ("rate", _F, (3,)), ("thrust", _F)])
#: what the controllers know of the vehicle: position m and velocity m/s, world axes; attitude deg; rates of the gyro
#: deg/s, body axes
ESTIMATE = np.dtype([("position", _F, (3,)), ("velocity", _F, (3,)), ("attitude", _F, (3,)), ("rate", _F, (3,))])
#: the loops' own states, the modes of the last set-point, and what the loops ask for: attitude, rates, thrust;
#: commands of roll, pitch, yaw
STATE = np.dtype([("loops", pid.STATE, (12,)), ("mode", _I, (6,)), ("attitude", _F, (3,)), ("rate", _F, (3,)),
                  ("thrust", _F), ("command", _F, (3,))])


@jit
def run(plant, state, setpoint, estimate, tick):
    """Run the controller once, at a tick (ms) at which the attitude loop is due: thrust and command of state (STATE).

    plant: its firmware's loops fly, its gains scale them. setpoint: SETPOINT; estimate: ESTIMATE.
    """
    settings = plant.firmware
    changed = False
    for i in range(6):
        changed = changed or state.mode[i] != setpoint.mode[i]
        state.mode[i] = setpoint.mode[i]
    if changed and settings.controller.reset_on_mode_change:
        reset(settings, state, estimate)
    dt = 0.001 * settings.periods.attitude_ms
    _heading(state, setpoint, dt)
    if tick % settings.periods.position_ms == 0:
        _position(plant, state, setpoint, estimate)
    if setpoint.mode[Z] == DISABLED:
        state.thrust = setpoint.thrust
    if setpoint.mode[X] == DISABLED or setpoint.mode[Y] == DISABLED:
        state.attitude[0], state.attitude[1] = setpoint.attitude[0], setpoint.attitude[1]
    _attitude(plant, state, setpoint, estimate, dt)
    if state.thrust == 0.0:
        state.command[0], state.command[1], state.command[2] = 0.0, 0.0, 0.0
        reset(settings, state, estimate)
        state.attitude[2] = estimate.attitude[2]


@jit
def reset(settings, state, estimate):
    """Reset every loop at the present ESTIMATE; with the derivative on the error, errors start at 0."""
    for i in range(12):
        pid.reset(state.loops[i], 0.0)
    for i in range(3):
        pid.reset(state.loops[place.POSITION_X + i], estimate.position[i])
        pid.reset(state.loops[place.ROLL + i], estimate.attitude[i])
    state.attitude[0], state.attitude[1] = estimate.attitude[0], estimate.attitude[1]
    if settings.controller.derivative_on_error:
        for i in range(12):
            state.loops[i].previous = 0.0


@jit
def _heading(state, setpoint, dt):
    """Desired yaw, within -180..180 deg."""
    if setpoint.mode[YAW] == VELOCITY:
        state.attitude[2] += setpoint.rate[2] * dt
    elif setpoint.mode[YAW] == ABSOLUTE:
        state.attitude[2] = setpoint.attitude[2]
    state.attitude[2] -= 360.0 * math.floor((state.attitude[2] + 180.0) / 360.0)


@jit
def _run_loop(plant, state, which, options, desired, measured):
    """Output of one of the twelve loops (a place of settings.LOOPS), run as pid.Options says."""
    return pid.run(plant.firmware.loops[which], state.loops[which], options, desired, measured)


@jit
def _velocity(plant, state, setpoint, estimate, across):
    """Desired velocity ahead, to the left (yaw's axes) and up, m/s: the position loops, or as the set-point says."""
    yaw = math.radians(estimate.attitude[2])
    c, n = math.cos(yaw), math.sin(yaw)
    p, v, at = setpoint.position, setpoint.velocity, estimate.position
    ahead, left, climb = v[0], v[1], v[2]
    if not setpoint.velocity_body:
        ahead, left = c * v[0] + n * v[1], c * v[1] - n * v[0]
    if setpoint.mode[X] == ABSOLUTE:
        ahead = _run_loop(plant, state, place.POSITION_X, across, c * p[0] + n * p[1], c * at[0] + n * at[1])
    if setpoint.mode[Y] == ABSOLUTE:
        left = _run_loop(plant, state, place.POSITION_Y, across, c * p[1] - n * p[0], c * at[1] - n * at[0])
    if setpoint.mode[Z] == ABSOLUTE:
        up = pid.Options(across.dt, plant.height_gain, across.on_error, False)
        climb = _run_loop(plant, state, place.POSITION_Z, up, p[2], at[2])
    return ahead, left, climb


@jit
def _position(plant, state, setpoint, estimate):
    """Position and velocity loops: desired roll, pitch and thrust."""
    settings, s = plant.firmware, plant.firmware.controller
    dt, on_error = 0.001 * settings.periods.position_ms, bool(s.derivative_on_error)
    across = pid.Options(dt, plant.position_gain, on_error, False)
    up = pid.Options(dt, plant.height_gain, on_error, False)
    yaw = math.radians(estimate.attitude[2])
    c, n = math.cos(yaw), math.sin(yaw)
    w = estimate.velocity
    ahead, left, climb = _velocity(plant, state, setpoint, estimate, across)
    pitch = -_run_loop(plant, state, place.VELOCITY_X, across, ahead, c * w[0] + n * w[1])
    roll = -_run_loop(plant, state, place.VELOCITY_Y, across, left, c * w[1] - n * w[0])
    state.attitude[0] = pid.limit(roll, s.tilt_limit_deg)
    state.attitude[1] = pid.limit(pitch, s.tilt_limit_deg)
    lift = _run_loop(plant, state, place.VELOCITY_Z, up, climb, w[2])
    state.thrust = min(max(lift * plant.thrust_scale + plant.thrust_base, plant.thrust_min), mixer.MOST)


@jit
def _attitude(plant, state, setpoint, estimate, dt):
    """Attitude and rate loops: desired rates and commands, dt seconds after the last."""
    settings = plant.firmware
    on_error = bool(settings.controller.derivative_on_error)
    rate = state.rate
    for i in range(3):
        options = pid.Options(dt, plant.attitude_gain, on_error, i == 2)
        rate[i] = _run_loop(plant, state, place.ROLL + i, options, state.attitude[i], estimate.attitude[i])
        if i < 2 and setpoint.mode[ROLL + i] == VELOCITY:
            rate[i] = setpoint.rate[i]
            if settings.controller.reset_in_rate_mode:
                pid.reset(state.loops[place.ROLL + i], 0.0)
    options = pid.Options(dt, plant.rate_gain * plant.rate_scale, on_error, False)
    for i in range(3):
        measured = -estimate.rate[1] if i == 1 else estimate.rate[i]
        out = _run_loop(plant, state, place.RATE_ROLL + i, options, rate[i], measured)
        state.command[i] = mixer.to_int16(out)
    state.command[2] = -state.command[2]
