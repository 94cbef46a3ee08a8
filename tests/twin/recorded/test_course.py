"""What is read off a log against how the flight was really flown."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import VELOCITY, FlightLog
from airtouch.simulation.firmware import setpoint
from airtouch.twin.recorded import missions
from airtouch.twin.recorded.course import PHASES, course, one_vehicle
from twin_courses import made_course


def without(log, *names):
    return FlightLog({k: v for k, v in log.columns.items() if k not in names}, dict(log.meta))


def test_edges_are_where_the_platform_is(sweeps):
    """Position is true in a simulated log: the drone is at the platform's edges at the course's edges."""
    for planned, log, _ in sweeps:
        measured = course(log)
        values = missions.course_values(planned)
        assert log["x_m"][measured.entry] == pytest.approx(values["before"], abs=0.03)
        assert log["x_m"][measured.exit] == pytest.approx(values["before"] + values["length"], abs=0.03)


def test_heights_and_times_are_those_of_the_mission(sweeps):
    errors = []
    for planned, log, plan in sweeps:
        measured = course(log)
        moving = np.flatnonzero(plan.setpoints[:, setpoint.VX] > 0.0)
        errors.append((measured.cruise_m - planned.cruise_m, measured.clearance_m - planned.clearance_m,
                       0.01 * (measured.step - moving[0]), 0.01 * (measured.exit + 100 * measured.stop_s - moving[-1])))
        assert measured.climb_s == pytest.approx(planned.climb_s, abs=0.8)  # to 85 % of the height, and the loop's lag
    cruise, clearance, step, stop = np.abs(errors).T
    assert np.median(cruise) < 0.03 and np.median(clearance) < 0.02
    assert np.median(step) < 0.3 and np.median(stop) < 0.8


def test_speed_comes_from_the_log(sweeps):
    """From velocities to 0.06 m/s in the median (drag holds the drone back by up to 0.1 m/s), from accelerations to
    0.08."""
    errors = []
    for planned, log, _ in sweeps:
        by_velocity = course(log)
        assert by_velocity.speed_from == "velocity"
        by_acceleration = course(without(log, *VELOCITY))
        assert by_acceleration.speed_from == "acceleration"
        errors.append((by_velocity.speed_mps - planned.speed_mps, by_acceleration.speed_mps - planned.speed_mps))
        assert course(log, 0.31).speed_mps == 0.31 and course(log, 0.31).speed_from == "stated"
    print(np.round(errors, 3))
    assert np.abs(errors).max(axis=0)[0] < 0.15
    assert (np.median(np.abs(errors), axis=0) < (0.06, 0.08)).all()


def test_phases_are_in_order_and_the_platform_is_low(sweeps):
    for _, log, _ in sweeps:
        measured = course(log)
        spans = measured.phases()
        assert tuple(spans) == PHASES
        low = log["zrange_m"] < 0.5 * measured.cruise_m
        assert low[spans["over"]].all() and not low[spans["hover"]].any() and not low[spans["cruise"]].any()
        assert spans["hover"].stop <= spans["cruise"].start <= spans["cruise"].stop <= spans["entry"].start


def test_flown_again_the_course_is_the_same(fly_course, vehicle):
    """Without noise and gusts, the mission made of a course brings its times back within a third of a second."""
    ideal = replace(vehicle, flow_noise_mps=(0.0, 0.0), range_drift_rms=0.0)
    compared = 0
    for number in range(5):
        try:
            first = course(fly_course(made_course(number, 0.06), {}, number, craft=ideal))
            high = first.cruise_m - 0.8  # the loop is still above its set height: ask for that much less
            second = course(fly_course(first, {}, 77, craft=ideal, height_m=-high))
        except AirTouchError:  # it came to rest over the platform
            continue
        compared += 1
        for name, most in (("before_s", 0.35), ("over_s", 0.35), ("cruise_m", 0.03), ("clearance_m", 0.03)):
            assert getattr(second, name) == pytest.approx(getattr(first, name), abs=most), name
    assert compared >= 3


def test_recorded_flights_have_their_true_edges(flights):
    folder = flights / "airtouch"
    with open(folder / "manifest.csv") as file:
        rows = [r for r in csv.DictReader(file) if r["use"] == "clean" and r["fold"] in "012"]
    speeds, tops = [], []
    for row in rows:
        log = logs.read(folder / row["file"])
        measured, (entry, leave, *_) = course(log), logs.true_edges(log)
        assert (measured.entry, measured.exit) == (entry.sample, leave.sample)
        assert 0.7 < measured.cruise_m < 0.9 and 0.0 <= measured.clearance_m < 0.13
        tops.append(measured.cruise_m - measured.clearance_m)
        speeds.append(measured.speed_mps - float(row["speed_mps"]))
    print(f"speed from acceleration less stated: median {np.median(speeds):+.3f}, quartiles "
          f"{np.percentile(speeds, [25, 75]).round(3)} m/s, {len(speeds)} flights")
    assert len(speeds) == 53
    assert np.mean(np.abs(np.array(tops) - 0.74) < 0.03) > 0.9  # one table
    assert abs(np.median(speeds)) < 0.08


def test_logs_that_do_not_do_say_what_to_fly(sweeps):
    log = sweeps[0][1]
    cases = {
        "no down range": without(log, "zrange_m"),
        "no platform in its down range; fly": log.slice(0, course(log).entry - 50),
        "free air before the platform; hover 5 s": log.slice(course(log).entry - 200, len(log)),
        "no column gyro_x_radps": without(log, "gyro_x_radps"),
        "logged at 50 Hz": FlightLog({k: v[::2] for k, v in log.columns.items()}, {"source": "half"}),
    }
    for message, faulty in cases.items():
        with pytest.raises(AirTouchError, match=message) as error:
            course(faulty)
        assert "\n" not in str(error.value)


def test_two_vehicles_are_refused(sweeps):
    log = sweeps[0][1]
    other = FlightLog(dict(log.columns), {**log.meta, "vehicle": "quadrotor-450"})
    assert one_vehicle([log, log]) == "crazyflie-2.1-flow"
    with pytest.raises(AirTouchError, match="two vehicles: .*; fit one twin for each"):
        one_vehicle([log, other])


def test_bias_of_the_down_range_moves_the_platform(sweeps):
    """The true distance is the one at which range_bias gives the reading; the platform goes with it."""
    bias = {"near": -0.03, "fade": 0.03, "dip": -0.02, "time": 0.2, "delay": 0.0}
    for reading in (0.0, 0.01, 0.05, 0.1):
        true = missions.true_distance(reading, bias)
        biased = true - 0.03 * np.exp(-true / 0.03) - 0.02 * np.exp(-missions.SETTLED_S / 0.2)
        assert max(biased, 0.0) == pytest.approx(reading, abs=2e-3)
        assert missions.true_distance(reading, {}) == reading
        assert missions.true_distance(reading, {**bias, "near": {"low": -0.04, "high": -0.02}}) == pytest.approx(true)
    planned = sweeps[0][0]
    unbiased, corrected = missions.course_values(planned), missions.course_values(planned, {"range_bias": bias})
    assert unbiased["top"] == pytest.approx(planned.before_m - planned.entered_m)
    assert corrected["top"] + corrected["clearance"] == pytest.approx(unbiased["top"] + unbiased["clearance"], abs=1e-4)
    assert corrected["clearance"] > unbiased["clearance"] + 0.01


def test_drawn_values_are_plain_and_positive(sweeps):
    for planned, _, _ in sweeps:
        values = missions.course_values(replace(planned, stop_s=0.0, before_s=0.0))
        assert all(isinstance(v, float) for v in values.values())
        assert values["before"] > 0 and values["stop"] > 0 and values["length"] > 0
