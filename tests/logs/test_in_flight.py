"""Whether the drone flies, on logs of a few rows worked out by hand."""

import numpy as np
import pytest

from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import PWM, FlightLog
from airtouch.logs.in_flight import airborne, flies_below


def log(**columns):
    return FlightLog({name: np.asarray(values, float) for name, values in columns.items()}, {"source": "made"})


def test_the_mean_of_four_motors_decides():
    motors = np.array([[0, 0, 0, 0], [60000, 0, 0, 1], [60000, 0, 0, 0], [15001] * 4, [15000] * 4])
    assert airborne(log(**dict(zip(PWM, motors.T, strict=True)))).tolist() == [False, True, False, True, False]


def test_a_lost_row_flies_as_the_last_one_that_was_not():
    power = np.array([0.0, np.nan, 40000.0, np.nan, np.nan, 0.0, np.nan])
    assert airborne(log(**dict.fromkeys(PWM, power))).tolist() == [False, False, True, True, True, False, False]


def test_rows_lost_from_the_beginning_do_not_fly():
    power = np.array([np.nan, np.nan, 40000.0])
    assert airborne(log(**dict.fromkeys(PWM, power))).tolist() == [False, False, True]


def test_a_motor_that_was_not_logged_at_a_sample_is_left_out_of_its_mean():
    """One motor without a reading kept the drone as it was in the row before."""
    motors = np.array([[0.0] * 4, [np.nan, 20000, 20000, 20000], [np.nan, 10000, 10000, 10000], [1, np.nan, 2, 3]])
    assert airborne(log(**dict(zip(PWM, motors.T, strict=True)))).tolist() == [False, True, False, False]


def test_a_motor_that_was_never_logged_leaves_the_range_to_tell():
    """A column of NaN kept the drone on the ground for the whole flight."""
    motors = dict.fromkeys(PWM, [40000.0] * 4) | {PWM[2]: [np.nan] * 4}
    assert airborne(log(**motors, zrange_m=[0.0, 0.3, 0.4, 0.0])).tolist() == [False, True, True, False]
    height = {"zrange_m": [np.nan] * 4, "z_m": [0.0, 0.3, 0.4, 0.0]}
    assert airborne(log(**motors, **height)).tolist() == [False, True, True, False]


def test_without_motors_the_range_says_from_where_to_where():
    flying = airborne(log(zrange_m=[0.02, 0.3, 0.05, np.nan, 0.2, 0.03]))
    assert flying.tolist() == [False, True, True, True, True, False]
    assert airborne(log(z_m=[0.0, 0.5, 0.0])).tolist() == [False, True, False]
    assert not airborne(log(zrange_m=[0.02, 0.1, np.nan])).any()


def test_the_down_range_comes_before_the_height():
    assert airborne(log(z_m=[1.0, 1.0], zrange_m=[0.0, 1.0])).tolist() == [False, True]


def test_motors_that_never_reach_the_threshold_leave_the_height_to_tell():
    """A PX4 quadrotor that hovers at 20 % throttle, 1 m up, was on the ground."""
    motors = dict.fromkeys(PWM, [0.0, 13107.0, 13107.0, 13107.0, 13107.0, 0.0, 0.0])
    quad = log(**motors, z_m=[0.0, 0.02, 1.0, 0.05, 1.0, 0.0, 0.4])  # at the end it is carried away
    assert airborne(quad).tolist() == [False, False, True, True, True, False, False]
    assert flies_below(quad) and any("never passes 15000" in w for w in logs.check(quad).warnings)
    assert not any("never passes" in w for w in logs.check(log(**motors, z_m=[0.0] * 7)).warnings)


def test_motors_off_or_a_low_height_are_no_flight_whatever_the_threshold():
    for motors, height in (([0.0] * 3, [0.0, 1.0, 1.0]), ([7000.0] * 3, [0.05] * 3), ([7000.0] * 3, [np.nan] * 3)):
        assert not airborne(log(**dict.fromkeys(PWM, motors), zrange_m=height)).any()
    assert not airborne(log(**dict.fromkeys(PWM, [13000.0] * 3))).any()  # no height to tell
    one_above = log(**dict.fromkeys(PWM, [13000.0, 16000.0, 13000.0]), zrange_m=[1.0] * 3)
    assert airborne(one_above).tolist() == [False, True, False] and not flies_below(one_above)


def test_another_threshold_of_the_vehicle_decides():
    quad = log(**dict.fromkeys(PWM, [13000.0, 11000.0]), zrange_m=[0.0, 0.0])
    assert airborne(quad).tolist() == [False, False] and airborne(quad, 11700.0).tolist() == [True, False]


def test_a_log_with_neither_is_refused():
    with pytest.raises(AirTouchError):
        airborne(log(gyro_x_radps=[0.0, 0.0]))
