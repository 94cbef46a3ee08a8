"""The platform's height and the error of the down range near it, against flights whose both are known."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.simulation.flight import Diverged, fly
from airtouch.twin.recorded import missions, near_range
from airtouch.twin.recorded.channels import channels
from airtouch.twin.recorded.course import course
from twin_courses import PLAIN, made_course

TOP = 0.74
BIAS = {"near": -0.05, "fade": 0.055, "delay": 0.035, "dip": 0.0}


@pytest.fixture(scope="module")
def platform_flights(vehicle):
    """Flights 2.5 to 10 cm over one platform, whose down range reads as BIAS says."""
    steady = replace(vehicle, range_drift_rms=0.004)  # as the twin of the authors' flights has it, or less
    out = []
    for number in range(24):
        planned = replace(made_course(number, 0.05), cruise_m=TOP + (0.025, 0.05, 0.075, 0.1)[number % 4], top_m=TOP)
        planned = replace(planned, before_m=planned.cruise_m)
        log = fly(missions.scenario_of(planned, {**PLAIN, "range_bias": BIAS}), steady, 6, number)
        if isinstance(log, Diverged):
            continue
        try:
            out.append((course(log, planned.speed_mps), channels(log)))
        except AirTouchError:
            continue
    assert len(out) >= 8
    return out


def test_height_of_the_platform_comes_back(platform_flights):
    """Within 8 mm and nearer than the steps of the down range alone;
    the error near the platform within 1.2 cm of its 1.7 to 2.9."""
    height = near_range.measure(*zip(*platform_flights, strict=True))
    steps = np.array([c.before_m - c.entered_m for c, _ in platform_flights])
    print(height, np.median(steps))
    assert height.top_m == pytest.approx(TOP, abs=0.008)
    assert abs(height.top_m - TOP) < 0.7 * abs(np.median(steps) - TOP)
    for distance in (0.03, 0.06):
        error = height.near * np.exp(-distance / height.fade)
        assert error == pytest.approx(BIAS["near"] * np.exp(-distance / BIAS["fade"]), abs=0.012)


def test_two_platforms_or_too_few_flights_are_not_measured(platform_flights):
    courses, shapes = zip(*platform_flights, strict=True)
    assert near_range.measure(courses[:3], shapes[:3]) is None
    two_places = [replace(c, before_m=c.before_m + 0.1 * (i % 2)) for i, c in enumerate(courses)]
    assert near_range.measure(two_places, shapes) is None


def test_a_known_top_is_flown():
    planned = replace(made_course(0, 0.05), top_m=0.73)
    assert missions.course_values(planned)["top"] == pytest.approx(0.73)
    assert missions.course_values(planned)["clearance"] == pytest.approx(planned.before_m - 0.73)
    assert missions.course_values(replace(planned, top_m=0.0))["top"] == pytest.approx(
        planned.before_m - planned.entered_m)
