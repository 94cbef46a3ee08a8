"""Attitude and heights that a log does not hold, worked out from what it does hold."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from airtouch.gap.flights.filters import both_ways, lowpass
from airtouch.logs.flight_log import ACC, ACC_WORLD, ATTITUDE, GYRO, POSITION, VELOCITY, FlightLog

#: below it the tilt comes from the acceleration over ground, above it from the gyro; chosen
CROSSOVER_HZ = 0.4
SHORTEST = 100  #: samples up to which a log is too short to be filtered: without angles it is taken as level; chosen
GRAVITY = 9.81  #: m/s^2: standard gravity, rounded
LEAST_LIFT = 0.5  #: share of gravity that the vertical force has at least where the tilt is its angle; chosen
MARKER_M = 0.05  #: height over the floor of a motion-capture marker on a Crazyflie that stands; chosen
PUSH_S = 0.05  #: standard deviation of the Gaussian that smooths velocity before it is differentiated; chosen
COURSE_S = 0.2  #: the same before the direction of flight is taken; chosen
MOVING_MPS = 0.05  #: speed up to which the vehicle has no direction of flight; chosen
MOST_AHEAD = 100  #: samples at most by which a rotor passes an edge before or after the range sensor; chosen
STEP_M = 0.06  #: change of the down range between two samples from which it is a step of the floor; chosen


def interpolate_missing(values: np.ndarray) -> np.ndarray:
    """Missing samples (n,) or (n, c) filled along the flight by straight lines; 0 where all are missing."""
    out = np.array(values, dtype=np.float64)
    table = out[:, None] if out.ndim == 1 else out
    finite = np.isfinite(table)
    for j in np.flatnonzero(~finite.all(axis=0)):
        good = np.flatnonzero(finite[:, j])
        table[:, j] = np.interp(np.arange(len(table)), good, table[good, j]) if len(good) else 0.0
    return out


def attitude(log: FlightLog, period_s: float) -> np.ndarray:
    """Roll, pitch, yaw (n, 3) in rad: logged angles where they are logged, else estimated.

    A multirotor's thrust points along its own z axis, so what it accelerates over ground
    gives the tilt at low frequency; the gyro gives the rest. Without a gyro the tilt is
    that of the specific force in world axes.
    """
    n = len(log)
    estimate = np.zeros((n, 3))
    tilt = _tilt(log, period_s)
    if log.has(*GYRO):
        turned = np.cumsum(interpolate_missing(log.stack(GYRO)), axis=0) * period_s
        estimate[:, 2] = turned[:, 2] - turned[0, 2] if not log.has("yaw_rad") else 0.0
        low = lowpass(CROSSOVER_HZ * 2.0 * period_s)
        if n > SHORTEST:
            estimate[:, :2] = turned[:, :2] - both_ways(low, turned[:, :2])
            estimate[:, :2] += both_ways(low, tilt)
    else:
        estimate[:, :2] = tilt
    for i, name in enumerate(ATTITUDE):
        if log.has(name):
            estimate[:, i] = interpolate_missing(log[name])
    return estimate


def _tilt(log: FlightLog, period_s: float) -> np.ndarray:
    """Roll and pitch (n, 2) of the specific force, in axes that are turned by yaw only."""
    n = len(log)
    if log.has(*VELOCITY[:2]):
        push = np.gradient(_smoothed_speed(log, PUSH_S, period_s), period_s, axis=0)
        up = np.full(n, GRAVITY)
    elif log.has(*ACC_WORLD):
        force = interpolate_missing(log.stack(ACC_WORLD))
        push, up = force[:, :2], np.maximum(force[:, 2], LEAST_LIFT * GRAVITY)
    elif log.meta.get("acc_frame") == "world" and log.has(*ACC):
        force = interpolate_missing(log.stack(ACC))
        push, up = force[:, :2], np.maximum(force[:, 2], LEAST_LIFT * GRAVITY)
    else:
        return np.zeros((n, 2))
    yaw = interpolate_missing(log["yaw_rad"]) if log.has("yaw_rad") else np.zeros(n)
    forward = np.cos(yaw) * push[:, 0] + np.sin(yaw) * push[:, 1]
    left = -np.sin(yaw) * push[:, 0] + np.cos(yaw) * push[:, 1]
    return np.column_stack([-np.arctan2(left, up), np.arctan2(forward, up)])


def _smoothed_speed(log: FlightLog, deviation_s: float, period_s: float) -> np.ndarray:
    """Horizontal velocity (n, 2), m/s, smoothed by a Gaussian of that standard deviation in seconds."""
    speed = interpolate_missing(log.stack(VELOCITY[:2]))
    return gaussian_filter1d(speed, deviation_s / period_s, axis=0, mode="nearest")


def rotor_heights(log: FlightLog, turn: np.ndarray, rotor_x: np.ndarray, rotor_y: np.ndarray,
                  below_rotors_m: float, standing_m: float, on_ground: np.ndarray,
                  period_s: float) -> np.ndarray | None:
    """Height (n, 4) of each rotor over what is under it, m, from the down range under the middle.

    The edge passes under a rotor earlier or later than under the sensor, by the rotor's
    distance along the path over the speed. Without a down range the floor is taken as flat
    and the height is that above standing, plus `standing_m`, the rotors' height then. None
    without position as well.
    """
    rise = turn[:, 2, :1] * rotor_x + turn[:, 2, 1:2] * rotor_y
    if not log.has("zrange_m"):
        if not log.has(POSITION[2]):
            return None
        z = interpolate_missing(log[POSITION[2]])
        return np.maximum((z - standing_z(z, on_ground) + standing_m)[:, None] + rise, 0.0)
    n, height = len(log), interpolate_missing(log["zrange_m"]) + below_rotors_m
    index = np.arange(n, dtype=np.float64)
    step = np.zeros((n, 4))
    if log.has(*VELOCITY[:2]):
        speed = _smoothed_speed(log, COURSE_S, period_s)
        size = np.hypot(speed[:, 0], speed[:, 1])
        moving = size > MOVING_MPS
        along = np.einsum("nij,nj->ni", turn[:, :2, :2].transpose(0, 2, 1), speed)
        ahead = along[:, :1] * rotor_x + along[:, 1:] * rotor_y
        step[moving] = ahead[moving] / size[moving, None] ** 2 / period_s
    here = _altitude(log, height)
    top = here - height
    step = np.clip(step, -MOST_AHEAD, MOST_AHEAD)
    shifted = np.column_stack([np.interp(index + step[:, i], index, top) for i in range(4)])
    return np.maximum(here[:, None] - shifted + rise, 0.0)


def standing_z(z: np.ndarray, on_ground: np.ndarray) -> float:
    """What z_m (n,) reads when the vehicle stands: its median on the ground where the log holds that.

    Else the lowest value, at most MARKER_M: a log cut out of a flight may never come down.
    """
    return float(np.median(z[on_ground])) if on_ground.any() else float(min(z.min(), MARKER_M))


def _altitude(log: FlightLog, height: np.ndarray) -> np.ndarray:
    """Height over the floor (n,): the logged one, else the down range without its steps."""
    if log.has(POSITION[2]):
        return interpolate_missing(log[POSITION[2]])
    change = np.diff(height, prepend=height[0])
    change[np.abs(change) > STEP_M] = 0.0
    return height[0] + np.cumsum(change)
