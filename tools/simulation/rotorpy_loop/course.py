"""A drawn mission: take off, hover, pass over a platform, hover, land."""

from typing import NamedTuple

import numpy as np

SPEED_MPS = 0.35
RISE_AT_S, RISE_S, PASS_AT_S, LANDING_S = 1.6, 1.2, 6.5, 2.0
SETTLING_S, RESTING_S = 1.5, 0.5  #: motors run so long after the descent; the log goes on so long without them
LANDED_M = -0.1  #: height that a landing asks for, below the ground so that the vehicle stands on it
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
        self.motors_off_s = self.land_at_s + LANDING_S + SETTLING_S
        self.total_s = self.motors_off_s + RESTING_S

    def at(self, t: float) -> SetPoint:
        """The set-point at t, s."""
        x = min(max(t - PASS_AT_S, 0.0) * SPEED_MPS, self.way_m)
        up = min(max(t - RISE_AT_S, 0.0) / RISE_S, 1.0)
        down = min(max(t - self.land_at_s, 0.0) / LANDING_S, 1.0)
        speed = SPEED_MPS if 0.0 < x < self.way_m else 0.0
        height_m = self.height_m * up + (LANDED_M - self.height_m) * down
        return SetPoint(np.array([x, 0.0, height_m]), np.array([speed, 0.0, 0.0]))

    def motors_run(self, t: float) -> bool:
        """Whether the motors are on at t, s."""
        return RISE_AT_S < t < self.motors_off_s

    def surface(self, x: float) -> float:
        """Height of what lies below x, m."""
        return self.top_m if BEGIN_M <= x <= self.end_m else 0.0

    def over_platform(self, x: np.ndarray, radius_m: float) -> np.ndarray:
        """Share of a level disc's area that is over the platform; x: of its centre, m, any shape."""
        before, after = (disc_beyond((edge - x) / radius_m) for edge in (BEGIN_M, self.end_m))
        return before - after


def disc_beyond(u: np.ndarray) -> np.ndarray:
    """Share of a disc's area beyond a straight line that lies u radii from its centre."""
    u = np.clip(u, -1.0, 1.0)
    return 0.5 - (np.arcsin(u) + u * np.sqrt(1.0 - u * u)) / np.pi
