"""The vehicle's attitude: as logged, else estimated from what the log holds."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import gaussian_filter1d

from airtouch.gap.flights.clock import PERIOD_S
from airtouch.gap.flights.filters import both_ways, lowpass
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.logs.flight_log import ACC, ACC_WORLD, ATTITUDE, GYRO, VELOCITY, FlightLog

#: below it the tilt comes from the acceleration over ground, above it from the gyro (complementary filter); chosen
CROSSOVER_HZ = 0.4
SHORTEST = 100  #: samples up to which a log is too short to be filtered: without angles it is taken as level; chosen
GRAVITY = 9.81  #: m/s^2: standard gravity, rounded
LEAST_LIFT = 0.5  #: share of gravity that the vertical force has at least where the tilt is its angle; chosen
#: share of gravity below which the median vertical force has gravity subtracted; chosen, between 0 and 1
WITHOUT_GRAVITY = 0.5
PUSH_S = 0.05  #: standard deviation of the Gaussian that smooths velocity before it is differentiated; chosen


def attitude(log: FlightLog) -> np.ndarray:
    """Roll, pitch, yaw (n, 3) in rad: logged angles where they are logged, else estimated.

    A multirotor's thrust points along its own z axis, so what it accelerates over ground
    gives the tilt at low frequency; the gyro gives the rest. Without a gyro the tilt is
    that of the specific force in world axes.

    Each rate of the gyro is integrated as if it were that of its own angle, which holds for small angles. What is left
    out is, for roll, tan(pitch) (q sin(roll) + r cos(roll)), for pitch (cos(roll) - 1) q - r sin(roll), where q and r
    are the rates about the body's y and z: at a tilt of 20 degrees up to 0.36 of the yaw rate. Of it only what changes
    faster than CROSSOVER_HZ stays in the tilt. A heading that is not logged is the integral of r, as if level.
    """
    n = len(log)
    estimate = np.zeros((n, 3))
    turned = np.cumsum(interpolate_missing(log.stack(GYRO)), axis=0) * PERIOD_S if log.has(*GYRO) else None
    if log.has("yaw_rad"):
        estimate[:, 2] = _logged_angle(log["yaw_rad"])
    elif turned is not None:
        estimate[:, 2] = turned[:, 2] - turned[0, 2]
    tilt = _tilt(log, estimate[:, 2])
    if turned is not None:
        low = lowpass(CROSSOVER_HZ * 2.0 * PERIOD_S)
        if n > SHORTEST:
            estimate[:, :2] = turned[:, :2] - both_ways(low, turned[:, :2])
            estimate[:, :2] += both_ways(low, tilt)
    else:
        estimate[:, :2] = tilt
    for i, name in enumerate(ATTITUDE[:2]):
        if log.has(name):
            estimate[:, i] = _logged_angle(log[name])
    return estimate


def _logged_angle(values: np.ndarray) -> np.ndarray:
    """A logged angle (n,), rad, without jumps by a turn, straight lines where it is missing."""
    known, out = np.isfinite(values), np.array(values)
    out[known] = np.unwrap(out[known])
    return interpolate_missing(out)


def in_world_axes(log: FlightLog) -> bool:
    """Whether the log's accelerations are in the axes of the world."""
    return log.meta.get("acc_frame") == "world" and log.has(*ACC)


def world_force(log: FlightLog, columns: Sequence[str], gravity: float = GRAVITY) -> np.ndarray:
    """Specific force (n, 3) m/s^2 of columns in the axes of the world, from which some logs have gravity subtracted.

    It is added again where the median vertical force is below WITHOUT_GRAVITY of it. gravity: m/s^2.
    """
    force = interpolate_missing(log.stack(columns))
    if np.median(force[:, 2]) < WITHOUT_GRAVITY * gravity:
        force[:, 2] += gravity
    return force


def _tilt(log: FlightLog, yaw: np.ndarray) -> np.ndarray:
    """Roll and pitch (n, 2) of the specific force, in axes that are turned by yaw (n,), rad, only."""
    n = len(log)
    if log.has(*VELOCITY[:2]):
        push = np.gradient(smoothed_speed(log, PUSH_S), PERIOD_S, axis=0)
        up = np.full(n, GRAVITY)
    elif log.has(*ACC_WORLD):
        force = world_force(log, ACC_WORLD)
        push, up = force[:, :2], np.maximum(force[:, 2], LEAST_LIFT * GRAVITY)
    elif in_world_axes(log):
        force = world_force(log, ACC)
        push, up = force[:, :2], np.maximum(force[:, 2], LEAST_LIFT * GRAVITY)
    else:
        return np.zeros((n, 2))
    forward = np.cos(yaw) * push[:, 0] + np.sin(yaw) * push[:, 1]
    leftward = -np.sin(yaw) * push[:, 0] + np.cos(yaw) * push[:, 1]
    return np.column_stack([-np.arctan2(leftward, up), np.arctan2(forward, up)])


def smoothed_speed(log: FlightLog, deviation_s: float) -> np.ndarray:
    """Horizontal velocity (n, 2), m/s, smoothed by a Gaussian of that standard deviation in seconds."""
    speed = interpolate_missing(log.stack(VELOCITY[:2]))
    return gaussian_filter1d(speed, deviation_s / PERIOD_S, axis=0, mode="nearest")
