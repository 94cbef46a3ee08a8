"""Courses that nobody flew, for tests."""

import numpy as np

from airtouch.twin.recorded.course import Course

#: a lively flight without the effects that a test moves
PLAIN = {"motor_noise": {"rms": 0.008, "time": 0.8, "fast": 0.006}, "gust": {"rms": 0.1}, "rotor_drag": {},
         "ground_effect": {"preset": "crazyflie-34g", "turbulence": 0.5, "turbulence_time": 0.04}}


def made_course(number, clearance_m, speed_mps=0.3):
    """A course of its own; its samples are not known before it is flown."""
    rng = np.random.default_rng(number)
    return Course(f"made {number}", 0.8, clearance_m, 0.8, clearance_m, 2.0, rng.uniform(5.0, 7.0),
                  rng.uniform(2.0, 3.0), rng.uniform(1.8, 2.4), 2.0, 4.0, speed_mps, "stated", 0.0, 0, 0, 0, 0, 0, 0)
