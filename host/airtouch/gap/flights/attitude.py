"""The vehicle's attitude: as logged, else estimated from what the log holds."""

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
PUSH_S = 0.05  #: standard deviation of the Gaussian that smooths velocity before it is differentiated; chosen


def attitude(log: FlightLog) -> np.ndarray:
    """Roll, pitch, yaw (n, 3) in rad: logged angles where they are logged, else estimated.

    A multirotor's thrust points along its own z axis, so what it accelerates over ground
    gives the tilt at low frequency; the gyro gives the rest. Without a gyro the tilt is
    that of the specific force in world axes.
    """
    n = len(log)
    estimate = np.zeros((n, 3))
    tilt = _tilt(log)
    if log.has(*GYRO):
        turned = np.cumsum(interpolate_missing(log.stack(GYRO)), axis=0) * PERIOD_S
        estimate[:, 2] = turned[:, 2] - turned[0, 2] if not log.has("yaw_rad") else 0.0
        low = lowpass(CROSSOVER_HZ * 2.0 * PERIOD_S)
        if n > SHORTEST:
            estimate[:, :2] = turned[:, :2] - both_ways(low, turned[:, :2])
            estimate[:, :2] += both_ways(low, tilt)
    else:
        estimate[:, :2] = tilt
    for i, name in enumerate(ATTITUDE):
        if log.has(name):
            estimate[:, i] = interpolate_missing(log[name])
    return estimate


def _tilt(log: FlightLog) -> np.ndarray:
    """Roll and pitch (n, 2) of the specific force, in axes that are turned by yaw only."""
    n = len(log)
    if log.has(*VELOCITY[:2]):
        push = np.gradient(smoothed_speed(log, PUSH_S), PERIOD_S, axis=0)
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
    leftward = -np.sin(yaw) * push[:, 0] + np.cos(yaw) * push[:, 1]
    return np.column_stack([-np.arctan2(leftward, up), np.arctan2(forward, up)])


def smoothed_speed(log: FlightLog, deviation_s: float) -> np.ndarray:
    """Horizontal velocity (n, 2), m/s, smoothed by a Gaussian of that standard deviation in seconds."""
    speed = interpolate_missing(log.stack(VELOCITY[:2]))
    return gaussian_filter1d(speed, deviation_s / PERIOD_S, axis=0, mode="nearest")
