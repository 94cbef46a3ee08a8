"""A millisecond of the firmware's estimator task: prediction, process noise, IMU, readings, in its own order."""

import math

import numpy as np

from airtouch.simulation.compiled import jit
from airtouch.simulation.firmware import kalman, measurement

_F = np.float64
#: what a tick's sensors hand over: the IMU's sample, acc m/s^2 and gyro rad/s; down range, distance m and its standard
#: deviation; optical flow, counts forward and left over dt seconds and their standard deviation. NaN in distance or
#: forward: no such reading
READING = np.dtype([("acc", _F, (3,)), ("gyro", _F, (3,)), ("distance", _F), ("distance_std", _F), ("forward", _F),
                    ("left", _F), ("dt", _F), ("std", _F)])


@jit
def tick(plant, est, now, flying, reading):
    """Tick `now` (ms, from 0) of the estimator est (kalman.STATE) with its READING.

    plant: its firmware and gravity count. flying: as the supervisor says.
    """
    settings = plant.firmware
    if now > 0:
        if now % settings.periods.prediction_ms == 0:
            kalman.predict(settings, est, 0.001 * settings.periods.prediction_ms, flying, plant.gravity)
        kalman.process_noise(settings, est, 0.001)
    kalman.take_imu(est, reading.acc, reading.gyro)
    if not math.isnan(reading.distance):
        measurement.correct_range(settings, est, reading)
    if not math.isnan(reading.forward):
        measurement.correct_flow(settings, est, reading)
    kalman.finalize(est)
    if kalman.lost(settings, est):
        kalman.begin(settings, est, 0.0, 0.0, 0.0, est.home)
