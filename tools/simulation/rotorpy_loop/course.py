"""A drawn mission: take off, hover, pass over a platform, hover, sink."""

from typing import NamedTuple

import numpy as np

SPEED_MPS = 0.35
RISE_AT_S, RISE_S, PASS_AT_S, LANDING_S = 1.6, 1.2, 6.5, 2.0
MOTORS_ON_S, MOTORS_OFF_S = RISE_AT_S - 0.8, LANDING_S - 0.1  #: the latter after the descent begins, before its end
BEGIN_M = 0.8  #: where the platform begins


class SetPoint(NamedTuple):
    """Position and velocity (3,) that the vehicle should have, m and m/s."""

    position: np.ndarray
    velocity: np.ndarray


class Course:
    """A mission over a platform from BEGIN_M to `end_m`, whose top is at `top_m`."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.height_m = rng.uniform(0.18, 0.4)
        self.top_m = self.height_m - rng.uniform(0.04, 0.12)
        self.end_m = rng.uniform(1.6, 2.0)
        self.way_m = self.end_m + rng.uniform(0.4, 0.8)
        self.land_at_s = PASS_AT_S + self.way_m / SPEED_MPS + rng.uniform(2.5, 4.0)
        self.total_s = self.land_at_s + LANDING_S

    def at(self, t: float) -> SetPoint:
        """The set-point at t, s."""
        x = min(max(t - PASS_AT_S, 0.0) * SPEED_MPS, self.way_m)
        up = min(max(t - RISE_AT_S, 0.0) / RISE_S, 1.0)
        down = min(max(t - self.land_at_s, 0.0) / LANDING_S, 1.0)
        speed = SPEED_MPS if 0.0 < x < self.way_m else 0.0
        return SetPoint(np.array([x, 0.0, self.height_m * min(up, 1.0 - down)]), np.array([speed, 0.0, 0.0]))

    def motors_run(self, t: float) -> bool:
        """Whether the motors are on at t, s."""
        return MOTORS_ON_S < t < self.land_at_s + MOTORS_OFF_S

    def surface(self, x: float) -> float:
        """Height of what lies below x, m."""
        return self.top_m if BEGIN_M <= x <= self.end_m else 0.0
