"""What down range and optical flow tell the Kalman filter: one scalar measurement at a time."""

import math
from typing import NamedTuple

from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware.kalman import LEAST_VARIANCE, MOST_VARIANCE

Z, VX, VY = 2, 3, 4  #: columns of the measurement matrix


class Measurement(NamedTuple):
    """A scalar measurement whose row of the measurement matrix has two entries, in columns i and j."""

    i: int
    at_i: float
    j: int
    at_j: float
    error: float  #: measured less predicted
    std: float  #: standard deviation of what was measured


@jit
def correct_range(settings, est, reading):
    """A down range reading (estimator.READING): z over the cosine of the tilt beyond the cone's half angle."""
    up = est.r[2, 2]
    if up <= 0.1:
        return
    stretch = 1.0 / math.cos(max(math.acos(min(up, 1.0)) - math.radians(settings.range.cone_deg), 0.0))
    _update(est, Measurement(Z, stretch, Z, 0.0, reading.distance - est.x[2] * stretch, reading.distance_std))


@jit
def range_std(settings, distance):
    """Standard deviation that the firmware gives a down range reading, m."""
    s = settings.range
    return s.std_m * (1.0 + math.exp(s.std_growth_1pm * (distance - s.std_far_m)))


@jit
def correct_flow(settings, est, reading):
    """A reading of optical flow (estimator.READING), counts along body x and y: two updates with the latest gyro
    sample."""
    s = settings.flow
    k = reading.dt * s.pixels / s.aperture_rad
    height = max(est.x[2], s.least_height_m)  # of both updates: taken before the first
    counts_per_mps = k * est.r[2, 2] / height
    ahead, aside, std = est.v[0], est.v[1], reading.std / s.counts_per_pixel
    turn_x, turn_y = k * est.gyro[0], k * est.gyro[1]
    error = reading.forward / s.counts_per_pixel - counts_per_mps * ahead + turn_y
    _update(est, Measurement(Z, -counts_per_mps * ahead / height, VX, counts_per_mps, error, std))
    error = reading.left / s.counts_per_pixel - counts_per_mps * aside - turn_x
    _update(est, Measurement(Z, -counts_per_mps * aside / height, VY, counts_per_mps, error, std))


@jit
def _update(est, m):
    """The Kalman update of one Measurement: state, attitude error and covariance."""
    p, c = est.p, est.column
    for n in range(9):
        c[n] = m.at_i * p[n, m.i] + m.at_j * p[n, m.j]
    inverse = 1.0 / (m.at_i * c[m.i] + m.at_j * c[m.j] + m.std * m.std)
    gain = m.error * inverse
    for n in range(3):
        est.x[n] += c[n] * gain
        est.v[n] += c[3 + n] * gain
        est.d[n] += c[6 + n] * gain
    for a in range(9):
        scaled = c[a] * inverse
        for b in range(a, 9):
            value = min(p[a, b] - scaled * c[b], MOST_VARIANCE)
            p[a, b], p[b, a] = value, value
        p[a, a] = max(p[a, a], LEAST_VARIANCE)
    est.updated = 1
