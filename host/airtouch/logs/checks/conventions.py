"""Columns in other units, or of another sign, than their names say.

A definition and two laws of physics tell. Roll is within +-pi, and pitch within +-pi/2. The mean lift of a vehicle in
the air is its weight, so that the accelerometer reads about one gravity along z. And what a gyro has turned in a short
time is what the attitude has changed.
"""

import numpy as np

from airtouch.logs.checks.clock import sample_period
from airtouch.logs.flight_log import ACC, ATTITUDE, GYRO, FlightLog

GRAVITY = 9.81  #: m/s^2: standard gravity, rounded
#: m/s^2, median of acc_z in the air: between these it is one g in g; the upper is the geometric mean of 1 and 9.81
IN_G = (0.5, 3.1)
#: ratio of what the gyro has turned to what the attitude has changed, above which one is in degrees: geometric mean of
#: 1 and 57.3
MISTAKEN_RATIO = float(np.sqrt(np.rad2deg(1.0)))
#: rad: within these is each angle by its definition; None for yaw, which a log may count on beyond one turn
BOUNDS = (np.pi, np.pi / 2.0, None)
MOST_BEYOND = 0.01  #: share of the samples in the air that may be beyond, as single wrong readings; chosen
SURE_CORRELATION = 0.8  #: of the two, least at which their ratio tells; chosen
WINDOW_S = 0.1  #: s over which they are compared; chosen: longer than the delay of an attitude filter
FEWEST_SAMPLES = 100  #: in the air; chosen


def wrong_units(log: FlightLog, flying: np.ndarray) -> list[str]:
    """A sentence on each column in other units than its name says, and on an acceleration that points down.

    No diagnosis of such a log means anything. flying: samples in the air, (n,) bool.
    """
    faults = _acceleration_faults(log, flying)
    if beyond := _beyond_bounds(log, flying):
        faults += beyond  # then a gyro that turns as far as the angles is in degrees as well
        log = log.with_columns({angle: np.deg2rad(log[angle]) for angle in ATTITUDE if log.has(angle)})
    for gyro, angle in zip(GYRO, ATTITUDE, strict=True):
        ratio = abs(turn_ratio(log, gyro, angle, flying))
        if ratio > MISTAKEN_RATIO:
            faults.append(f"{gyro} turns {ratio:.1f} times as far as {angle}: it is to be in rad/s; from deg/s it is "
                          f"multiplied by pi/180")
        elif ratio < 1.0 / MISTAKEN_RATIO:
            faults.append(f"{angle} turns {1.0 / ratio:.1f} times as far as {gyro}: they are to be in rad and rad/s; "
                          "from degrees the angle is multiplied by pi/180")
    return faults


def wrong_signs(log: FlightLog, flying: np.ndarray) -> list[str]:
    """A sentence on each rate of the gyro that turns against the attitude. flying: samples in the air, (n,) bool."""
    return [f"{gyro} turns against {angle}: one of them has the wrong sign (axes: x forward, y left, z up)"
            for gyro, angle in zip(GYRO, ATTITUDE, strict=True) if turn_ratio(log, gyro, angle, flying) < 0.0]


def _acceleration_faults(log: FlightLog, flying: np.ndarray) -> list[str]:
    """A sentence where the median of acc_z in the air is one g in g, or negative. flying: (n,) bool."""
    lift = log[ACC[2]][flying] if log.has(ACC[2]) else np.empty(0)
    lift = lift[np.isfinite(lift)]
    if len(lift) < FEWEST_SAMPLES:
        return []
    median = float(np.median(lift))
    prefix = f"{ACC[2]}: median {median:.2f} m/s^2 in the air, where it is about {GRAVITY:g}"
    faults = []
    if IN_G[0] < abs(median) < IN_G[1]:
        faults.append(f"{prefix}: it is to be in m/s^2; from g it is multiplied by {GRAVITY:g}, as acc_x and acc_y are")
    if median < -IN_G[0]:
        faults.append(f"{prefix}: it is to be positive where the vehicle hovers (axes: x forward, y left, z up)")
    return faults


def _beyond_bounds(log: FlightLog, flying: np.ndarray) -> list[str]:
    """A sentence on each angle that is beyond the bounds of its definition in the air. flying: (n,) bool."""
    faults = []
    for angle, bound in zip(ATTITUDE, BOUNDS, strict=True):
        if bound is None or not log.has(angle):
            continue
        size = np.abs(log[angle][flying])
        size = size[np.isfinite(size)]
        beyond = float((size > bound).mean()) if len(size) >= FEWEST_SAMPLES else 0.0
        if beyond > MOST_BEYOND:
            faults.append(f"{angle} is beyond its bound of {bound:.4g} rad in {beyond:.0%} of the samples in the air: "
                          "it is to be in rad; from degrees it is multiplied by pi/180, as all angles are")
    return faults


def turn_ratio(log: FlightLog, gyro: str, angle: str, flying: np.ndarray) -> float:
    """What a gyro's rate has turned in WINDOW_S over what an angle has changed: slope of the regression in the air.

    About 1, as Euler angles turn like the body at small tilt; 1 too where it is not sure: without the columns, for
    fewer than FEWEST_SAMPLES, or correlated less than SURE_CORRELATION. flying: (n,) bool.
    """
    period = sample_period(log)
    step = max(1, round(WINDOW_S / period))
    if not log.has(gyro, angle) or len(log) <= step:
        return 1.0
    rates, angles = log[gyro], log[angle]
    turned = np.cumsum(np.where(np.isfinite(rates), rates, 0.0)) * period
    turned, changed = turned[step:] - turned[:-step], angles[step:] - angles[:-step]
    sure = flying[step:] & flying[:-step] & np.isfinite(changed) & (np.abs(changed) < np.pi)  # no jump by a turn
    turned, changed = turned[sure], changed[sure]
    if len(turned) < FEWEST_SAMPLES or not np.ptp(turned) > 0.0 or not np.ptp(changed) > 0.0:
        return 1.0
    if abs(np.corrcoef(turned, changed)[0, 1]) < SURE_CORRELATION:
        return 1.0
    return float(turned @ changed / (changed @ changed))
