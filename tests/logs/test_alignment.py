"""Signals of different rates on one clock, against means and last values worked out by hand."""

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.logs.alignment import HOLD_S, aligned_log

META = {"source": "x"}


def test_a_fast_imu_is_averaged_over_each_ten_milliseconds():
    fast = np.arange(0.0, 1.0, 0.001)
    log = aligned_log({"acc_x_mps2": (fast, np.sin(2 * np.pi * 200.0 * fast)), "gyro_x_radps": (fast, 3.0 * fast)},
                      META)
    assert np.abs(log["acc_x_mps2"][1:-1]).max() < 0.05  # 200 Hz would fold to 0 Hz and stand there
    # the mean of ten samples about a tick lies half a sample before or behind it
    np.testing.assert_allclose(log["gyro_x_radps"][1:-1], 3.0 * log["t_s"][1:-1], atol=3.0 * 0.00051)


@pytest.mark.parametrize(("name", "limit_s"), [("zrange_m", 0.15), ("x_m", HOLD_S), ("vbat_V", 5.0)])
def test_a_slow_signal_repeats_its_last_value_and_no_longer_than_the_limit(name, limit_s):
    times = np.arange(0.0, 7.0, 0.01)
    log = aligned_log({"acc_x_mps2": (times, times), name: (np.array([0.2]), np.array([4.0]))}, META)
    held_value = (log["t_s"] >= 0.2 - 1e-6) & (log["t_s"] <= 0.2 + limit_s + 1e-6)
    assert (log[name][held_value] == 4.0).all() and np.isnan(log[name][~held_value]).all()
    np.testing.assert_array_equal(log["acc_x_mps2"], times)  # 100 Hz stays as it is


def test_a_battery_logged_once_a_second_has_a_value_at_every_sample():
    """Three of four samples were missing."""
    times, seconds = np.arange(0.0, 10.0, 0.01), np.arange(0.0, 10.0)
    log = aligned_log({"acc_x_mps2": (times, times), "vbat_V": (seconds, 4.0 - 0.01 * seconds)}, META)
    np.testing.assert_allclose(log["vbat_V"], 4.0 - 0.01 * np.floor(log["t_s"] + 1e-6))


def test_the_clock_begins_with_the_imu_and_samples_without_a_time_are_left_out():
    log = aligned_log({"gyro_x_radps": (np.array([5.02, np.nan, 5.0, 5.01]), np.array([3.0, 9.0, 1.0, 2.0])),
                       "vbat_V": (np.array([4.99]), np.array([3.9])), "x_m": (np.empty(0), np.empty(0))}, META)
    np.testing.assert_allclose(log["t_s"], [0.0, 0.01, 0.02], atol=1e-9)
    np.testing.assert_array_equal(log["gyro_x_radps"], [1.0, 2.0, 3.0])
    assert (log["vbat_V"] == 3.9).all() and "x_m" not in log.columns


def test_a_gap_in_a_fast_imu_repeats_the_last_sample():
    fast = np.r_[np.arange(0.0, 0.1, 0.001), np.arange(0.2, 0.3, 0.001)]
    log = aligned_log({"acc_z_mps2": (fast, np.where(fast < 0.15, 1.0, 2.0))}, META)
    assert (log["acc_z_mps2"][:19] == 1.0).all() and (log["acc_z_mps2"][20:] == 2.0).all()


def test_no_imu_and_a_clock_of_a_day_are_refused():
    with pytest.raises(AirTouchError, match="x: neither accelerations nor rates"):
        aligned_log({"vbat_V": (np.array([0.2]), np.array([4.0]))}, META)
    with pytest.raises(AirTouchError, match="its clock spans 86400 s"):
        aligned_log({"acc_x_mps2": (np.array([0.0, 86400.0]), np.zeros(2))}, META)
