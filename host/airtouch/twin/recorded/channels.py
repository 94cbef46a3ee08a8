"""The twelve channels in which a recorded and a simulated flight are compared."""

import functools

import numpy as np
from scipy.signal import lfilter

from airtouch import vehicle as vehicles
from airtouch.detector.shared.channels import level_acceleration
from airtouch.logs.checks.clock import sample_period
from airtouch.logs.flight_log import GYRO, PWM, FlightLog
from airtouch.reference.finite import hold_finite
from airtouch.vehicle import Vehicle

#: names of the channels
NAMES = ("ax", "ay", "az", "gyro x", "gyro y", "gyro z", "motor roll", "motor pitch", "motor yaw",
         "motor mean", "unexplained az", "down range")
#: units of the channels
UNITS = ("m/s²",) * 3 + ("°/s",) * 3 + ("PWM",) * 4 + ("m/s²", "cm")
#: columns of the channels
(AX, AY, AZ, GYRO_X, GYRO_Y, GYRO_Z, ROLL, PITCH, YAW, MEAN, UNEXPLAINED, DOWN) = range(12)
GRAVITY = 9.81  #: m/s²
LAG_S, DELAY = 0.06, 2  #: first-order lag (s) and delay (samples) of thrust, as in `reference.motion_channels`
#: percentile of the lagged thrust, and fraction of it from which the drone flies; no source: round numbers
FLIGHT_PERCENTILE, FLIGHT_FRACTION = 90, 0.5
#: signs of motors 1 to 4 in a roll, pitch (nose up) and yaw command, as `simulation.firmware.mixer` mixes them
ROTOR_SIGNS = {"roll": (-1, -1, 1, 1), "pitch": (1, -1, -1, 1), "yaw": (1, -1, 1, -1)}
#: motors 1 to 4 to roll, pitch, yaw and mean
MIX = np.array([*ROTOR_SIGNS.values(), (0.25, 0.25, 0.25, 0.25)])


def channels(log: FlightLog) -> np.ndarray:
    """The channels of a 100 Hz log, (n, 12), with columns NAMES in UNITS; az is without gravity.

    `unexplained az` is az less g times the lagged thrust divided by its mean in the air, so that mass and
    thrust curve matter little. Raises AirTouchError for columns that the log lacks.
    """
    acc = hold_finite(level_acceleration(log))[0]
    rate = np.rad2deg(hold_finite(log.stack(GYRO))[0])
    pwm = hold_finite(log.stack(PWM))[0]
    down = hold_finite(log["zrange_m"][:, None])[0]
    thrust = _reference().thrust(pwm).sum(axis=1)
    gain = 1.0 - np.exp(-sample_period(log) / LAG_S)
    delayed = np.r_[np.repeat(thrust[:1], DELAY), thrust[:-DELAY]]
    lagged, _ = lfilter([gain], [1.0, gain - 1.0], delayed, zi=[(1.0 - gain) * delayed[0]])
    flying = lagged > FLIGHT_FRACTION * np.percentile(lagged, FLIGHT_PERCENTILE)
    mean = lagged[flying].mean() if flying.any() else 1.0
    return np.column_stack([acc[:, :2], acc[:, 2] - GRAVITY, rate, pwm @ MIX.T,
                            acc[:, 2] - GRAVITY * lagged / max(mean, 1e-9), 100.0 * down])


@functools.cache
def _reference() -> Vehicle:
    """The thrust curve of a Crazyflie 2.1; only ratios of thrusts are used."""
    return vehicles.load()
