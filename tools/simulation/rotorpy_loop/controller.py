"""A cascade of P and PI controllers from position to PWM, with gains of its own."""

from typing import NamedTuple

import numpy as np

from .course import SetPoint
from .labels import STEP_S
from .vehicle import ARM_M, GRAVITY, INERTIA, MASS_KG, YAW_ARM_M, pwm_of_thrust

POSITION_GAIN, MOST_MPS = 2.0, 0.6  #: 1/s, and the most that it asks for
VELOCITY_GAIN, VELOCITY_INTEGRAL = np.array([3.0, 3.0, 6.0]), np.array([0.8, 0.8, 4.0])  #: 1/s, 1/s^2
MOST_SUM_M = 0.6  #: of the velocity's integral
MOST_TILT_RAD = 0.35
ANGLE_GAIN = 7.0  #: 1/s
RATE_GAIN, RATE_INTEGRAL, MOST_SUM_RAD = np.array([28.0, 28.0, 12.0]), 25.0, 0.5  #: 1/s, 1/s^2, rad


class Estimate(NamedTuple):
    """State estimate, (3,) each: position, velocity, roll, pitch and yaw, body rates; m, m/s, rad, rad/s."""

    position: np.ndarray
    velocity: np.ndarray
    angles: np.ndarray
    rates: np.ndarray


class Controller:
    """The loop; its integrals are its state. rate_factor: on the gains of the rates, 1 in the nominal vehicle."""

    def __init__(self, rate_factor: float = 1.0) -> None:
        self.rate_factor = rate_factor
        self.sum_velocity, self.sum_rate = np.zeros(3), np.zeros(3)

    def pwm(self, set_point: SetPoint, estimate: Estimate) -> np.ndarray:
        """PWM (4,) for a set-point and a state estimate."""
        asked = np.clip(POSITION_GAIN * (set_point.position - estimate.position), -MOST_MPS, MOST_MPS)
        error = asked + set_point.velocity - estimate.velocity
        self.sum_velocity = np.clip(self.sum_velocity + error * STEP_S, -MOST_SUM_M, MOST_SUM_M)
        acceleration = VELOCITY_GAIN * error + VELOCITY_INTEGRAL * self.sum_velocity
        pitch, roll = np.clip(np.array([acceleration[0], -acceleration[1]]) / GRAVITY, -MOST_TILT_RAD, MOST_TILT_RAD)
        upright = max(np.cos(estimate.angles[0]) * np.cos(estimate.angles[1]), 0.6)
        thrust = MASS_KG * np.clip(GRAVITY + acceleration[2], 2.0, 16.0) / upright
        rate_error = ANGLE_GAIN * (np.array([roll, pitch, 0.0]) - estimate.angles) - estimate.rates
        self.sum_rate = np.clip(self.sum_rate + rate_error * STEP_S, -MOST_SUM_RAD, MOST_SUM_RAD)
        torque = self.rate_factor * np.array(INERTIA) * (RATE_GAIN * rate_error + RATE_INTEGRAL * self.sum_rate)
        r, p = torque[:2] / (ARM_M / np.sqrt(2.0))
        y = torque[2] / YAW_ARM_M
        return pwm_of_thrust(0.25 * (thrust + np.array([-r - p - y, -r + p + y, r + p - y, r - p + y])))
