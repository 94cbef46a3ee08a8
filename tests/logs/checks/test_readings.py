"""Values and times that cannot be, against a search through every stretch of time and hand-made logs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airtouch.errors import AirTouchError
from airtouch.logs.checks.readings import LARGEST, without_impossible_values
from airtouch.logs.flight_log import FlightLog


def log(**columns):
    meta = {"warnings": [], **columns.pop("meta", {})}
    return FlightLog({name: np.asarray(values, float) for name, values in columns.items()}, meta)


def most_together(times):
    """How many times at most lie in one stretch of n times 5 s, by trying each as its beginning."""
    return max(int(((times >= t) & (times <= t + 5.0 * len(times))).sum()) for t in times)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.sampled_from([0.0, 0.01, 0.5, 7.0, 31.0, 90.0, 400.0, 5000.0, -60.0]), min_size=2, max_size=9))
def test_the_times_that_stay_are_the_most_that_fit_together(times):
    times = np.array(times)
    most = most_together(times)
    try:
        times_after = without_impossible_values(log(t_s=times, gyro_x_radps=times))["t_s"]
    except AirTouchError as error:
        assert "times cannot be" in str(error)
        return
    stay = times_after[np.isfinite(times_after)]
    assert len(stay) == most and 2 * most >= len(times)
    assert np.ptp(stay) <= 5.0 * len(times) and set(stay) <= set(times)


def test_values_beyond_float32_are_missing_and_counted():
    readings = without_impossible_values(log(m1_pwm=[1.0, 2.0 * LARGEST, -np.inf, LARGEST, np.nan]))
    np.testing.assert_array_equal(readings["m1_pwm"], [1.0, np.nan, np.nan, LARGEST, np.nan])
    assert "2 of 5 values" in readings.meta["warnings"][0] and "sample 1" in readings.meta["warnings"][0]


def test_a_clock_that_is_not_in_seconds_is_refused():
    with pytest.raises(AirTouchError, match="10 s from sample to sample"):
        without_impossible_values(log(t_s=np.arange(0.0, 5000.0, 10.0)))


def test_metadata_that_cannot_be_is_left_out():
    readings = without_impossible_values(log(t_s=[0.0, 0.01], meta={"sample_period_s": True, "acc_frame": "moon"}))
    assert "sample_period_s" not in readings.meta and readings.meta["acc_frame"] == "body"
    assert len(readings.meta["warnings"]) == 2


@pytest.mark.parametrize(("logged_s", "warned"), [(0.02, True), (0.0106, True), (0.0094, True), (0.0104, False),
                                                  (0.0096, False)])
def test_a_clock_that_contradicts_the_stated_period_is_told(logged_s, warned):
    """Times at 50 Hz beside a stated 100 Hz were resampled from 100 Hz without a word."""
    made = log(t_s=7.0 + logged_s * np.arange(300), meta={"sample_period_s": 0.01})
    once = without_impossible_values(made)
    notes = [w for w in once.meta["warnings"] if "sample_period_s" in w]
    assert len(notes) == warned and (not warned or f"{logged_s:.4g} s a sample" in notes[0])
    assert without_impossible_values(once).meta["warnings"] == once.meta["warnings"]


def test_late_bursts_contradict_no_period():
    arrival = 0.01 * np.arange(600) + np.where(np.arange(600) % 100 < 30, 0.3, 0.0)
    assert without_impossible_values(log(t_s=arrival, meta={"sample_period_s": 0.01})).meta["warnings"] == []
