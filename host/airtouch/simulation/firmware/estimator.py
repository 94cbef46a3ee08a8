"""A millisecond of the firmware's estimator task: prediction, process noise, IMU, readings, in its own order."""

import math

import numpy as np

from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware import kalman

_F = np.float64
#: what a tick's sensors hand over: distance m and its standard deviation; counts forward and left over dt seconds
#: and theirs. NaN in distance or forward: no such reading
READING = np.dtype([("distance", _F), ("distance_std", _F), ("forward", _F), ("left", _F), ("dt", _F), ("std", _F)])


@jit
def tick(settings, est, now, flying, gravity, acc, gyro, reading):
    """Tick `now` (ms, from 0) of the estimator est (kalman.STATE).

    flying: as the supervisor says. acc (3,) m/s^2 and gyro (3,) rad/s: the IMU's sample; reading: READING.
    """
    if now > 0:
        if now % settings.periods.prediction_ms == 0:
            kalman.predict(settings, est, 0.001 * settings.periods.prediction_ms, flying, gravity)
        kalman.process_noise(settings, est, 0.001)
    kalman.take_imu(est, acc, gyro)
    if not math.isnan(reading.distance):
        kalman.correct_range(settings, est, reading.distance, reading.distance_std)
    if not math.isnan(reading.forward):
        kalman.correct_flow(settings, est, reading.forward, reading.left, reading.dt, reading.std, 0.0)
    kalman.finalize(est)
    if kalman.lost(settings, est):
        kalman.begin(settings, est, 0.0, 0.0, 0.0, est.home)
