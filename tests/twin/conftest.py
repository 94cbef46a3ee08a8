"""Simulated flights of made-up courses: their truth is known."""

from dataclasses import replace

import pytest

from airtouch import vehicle as vehicles
from airtouch.simulation import scenario
from airtouch.simulation.flight import Diverged, fly
from airtouch.twin.recorded import missions
from twin_courses import PLAIN, made_course


@pytest.fixture(scope="session")
def vehicle():
    return vehicles.load("crazyflie-2.1-flow")


@pytest.fixture(scope="session")
def fly_course(vehicle):
    """fly_course(course, effects, number) -> a log that ended well, or None."""
    def flight_of(course, effects=PLAIN, number=0, seed=3, craft=vehicle, pulse_s=0.0, **mission):
        course = replace(course, pulse_s=pulse_s) if pulse_s else course
        log = fly(missions.scenario_of(course, effects, **mission), craft, seed, number)
        return None if isinstance(log, Diverged) else log
    return flight_of


@pytest.fixture(scope="session")
def sweeps(fly_course):
    """Twelve flights at 3, 6 and 9 cm: (course as planned, log, set-points)."""
    out = []
    for number in range(12):
        course = made_course(number, (0.035, 0.06, 0.09)[number % 3], (0.25, 0.35)[number % 2])
        log = fly_course(course, number=number)
        values = missions.course_values(course)
        if log is not None and log["x_m"].max() > values["before"] + values["length"] + 0.15:  # it left the platform
            plan = scenario.draw_flight(missions.scenario_of(course, PLAIN), 3, number)
            out.append((course, log, plan))
    assert len(out) >= 8
    return out
