"""Velocity pulses in the hover: flown by a mission, read off a log."""

import csv

import numpy as np
import pytest

from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.simulation.firmware import setpoint
from airtouch.simulation.flight_plan import mission, world
from airtouch.twin.recorded import missions, pulses
from airtouch.twin.recorded.course import course
from twin_courses import PLAIN, made_course


@pytest.fixture(scope="module")
def pulsing(fly_course):
    """Six flights with pulses of 0.2 m/s backwards every 0.52 s in the hover: (course read, log)."""
    flights = []
    for number in range(6):
        planned = made_course(number, 0.06)
        log = fly_course(planned, PLAIN, number, pulse_mps=-0.2, pulse_s=0.52)
        if log is not None:
            flights.append((course(log), log))
    assert len(flights) >= 5
    return flights


def test_their_period_is_read_off_the_log(pulsing):
    periods = [measured.pulse_s for measured, _ in pulsing]
    print(periods)
    assert np.abs(np.array(periods) - 0.52).max() < 0.01


def test_flights_without_pulses_have_none(sweeps):
    assert [course(log).pulse_s for _, log, _ in sweeps] == [0.0] * len(sweeps)


def test_they_move_the_drone(pulsing, sweeps):
    """The pitch rate of the hover swings by more than 1.3 times what it does without pulses."""
    def swing(measured, log):
        return np.std(log["gyro_y_radps"][measured.phases()["hover"]])
    with_pulses = np.median([swing(measured, log) for measured, log in pulsing])
    assert with_pulses > 1.3 * np.median([swing(course(log), log) for _, log, _ in sweeps])


def test_recorded_flights(flights):
    """Of folds 0 to 2 more than half have pulses, all with one period."""
    with open(flights / "airtouch" / "manifest.csv") as file:
        rows = [r for r in csv.DictReader(file) if r["use"] == "clean" and r["fold"] in "012"]
    periods = []
    for row in rows:
        measured = course(logs.read(flights / "airtouch" / row["file"]))
        periods.append(measured.pulse_s)
    of_pulses = np.array([p for p in periods if p])
    print(f"{len(of_pulses)} of {len(periods)} flights, {of_pulses.min():.3f} to {of_pulses.max():.3f} s")
    assert 25 <= len(of_pulses) <= 40
    assert np.abs(of_pulses - 0.521).max() < 0.006


def test_pulses_need_velocity_control_and_a_period():
    step = [{"do": "take-off", "height_m": 0.5}, {"do": "hover", "time_s": 2.0, "pulse_mps": 0.2, "every_s": 0.5}]
    rows = mission.setpoints({"step": step}, world.build([]), "test")
    assert set(np.unique(rows[:, setpoint.VX])) == {0.0, 0.2}
    assert (rows[:, setpoint.VX] > 0).sum() == 4 * mission.PULSE_ROWS
    with pytest.raises(AirTouchError, match="velocity control"):
        mission.setpoints({"step": step, "control": "position"}, world.build([]), "test")
    step[1].pop("every_s")
    with pytest.raises(AirTouchError, match="every_s"):
        mission.setpoints({"step": step}, world.build([]), "test")


def test_a_course_without_pulses_draws_none():
    assert missions.course_values(made_course(0, 0.05), pulse_mps=-0.2)["pulse"] == 0.0
    assert pulses.period(None, 0, 50) == 0.0
