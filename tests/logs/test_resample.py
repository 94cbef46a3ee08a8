"""Resampling against closed forms: tones kept, tones that would fold removed, gaps left open."""

import numpy as np
import pytest

from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog


def tone(frequency, rate=500.0, seconds=8.0):
    t = np.arange(int(seconds * rate)) / rate
    return FlightLog({"t_s": 2.0 + t, "acc_x_mps2": np.sin(2 * np.pi * frequency * t)}, {"source": "made"})


def test_low_tone_is_kept_and_high_tone_does_not_fold():
    low_tone = logs.resample(tone(5.0))
    t = low_tone["t_s"]
    assert len(low_tone) == 800 and np.allclose(np.diff(t), 0.01, atol=1e-12)
    np.testing.assert_allclose(low_tone["acc_x_mps2"][50:-50], np.sin(2 * np.pi * 5 * t)[50:-50], atol=0.005)
    folded = logs.resample(tone(90.0))["acc_x_mps2"][50:-50]  # 90 Hz would appear at 10 Hz
    assert np.abs(folded).max() < 1e-3
    assert low_tone.meta["resampled"]["from_hz"] == pytest.approx(500) and low_tone.meta["sample_period_s"] == 0.01
    assert any("resampled" in w for w in low_tone.meta["warnings"])


def test_gaps_are_not_filled():
    log = tone(1.0, rate=100.0)
    rows = np.r_[0:200, 205:400, 450:800]
    log = FlightLog({k: v[rows] for k, v in log.columns.items()}, {"source": "made"})
    new = logs.resample(log)
    missing = np.flatnonzero(np.isnan(new["acc_x_mps2"]))
    assert missing.tolist() == list(range(400, 450))
    short = np.sin(2 * np.pi * np.arange(200, 205) / 100)
    np.testing.assert_allclose(new["acc_x_mps2"][200:205], short, atol=0.01)
    assert new.meta["resampled"]["lost_samples"] == 55


def test_one_period_of_a_slow_log_is_no_gap():
    """At 5 Hz samples are 0.2 s apart, more than the 0.1 s that a gap may have in a faster log."""
    time = np.r_[0.2 * np.arange(20), 4.2 + 0.2 * np.arange(20)]  # one sample lost before 4.2 s
    new = logs.resample(FlightLog({"t_s": time, "x_m": time}, {"source": "made"}), 10.0)
    lost = (new["t_s"] > 3.8 + 1e-6) & (new["t_s"] < 4.2 - 1e-6)
    assert np.isnan(new["x_m"][lost]).all() and lost.sum() == 3
    np.testing.assert_allclose(new["x_m"][~lost], new["t_s"][~lost], atol=1e-9)


def test_arrival_times_are_not_taken_for_sample_times():
    rng = np.random.default_rng(0)
    arrival = np.arange(1000) * 0.01 + rng.exponential(0.003, 1000)
    arrival[300:330] = arrival[329] + np.arange(30) * 1e-4
    x = rng.normal(size=1000)
    log = FlightLog({"t_s": arrival, "acc_x_mps2": x}, {"source": "made", "sample_period_s": 0.01})
    new = logs.resample(log)
    np.testing.assert_allclose(new["acc_x_mps2"], x[:len(new)], atol=1e-9)


def test_steps_are_held_angles_unwrapped_motors_in_range():
    t = np.arange(2000) / 500.0
    log = FlightLog({"t_s": t, "zrange_m": np.where(t < 2, 0.8, 0.05),
                     "yaw_rad": np.angle(np.exp(1j * 3 * t)),
                     "m1_pwm": np.where(t < 2, 0.0, 65535.0)}, {"source": "made"})
    new = logs.resample(log)
    assert set(np.unique(new["zrange_m"])) == {0.05, 0.8}
    error = np.angle(np.exp(1j * (new["yaw_rad"] - 3 * new["t_s"])))
    assert np.abs(error[20:-20]).max() < 1e-3 and np.abs(new["yaw_rad"]).max() <= np.pi
    assert new["m1_pwm"].min() >= 0 and new["m1_pwm"].max() <= 65535


def test_a_slow_battery_and_range_are_held_between_their_readings():
    """Logged at 1 Hz and 10 Hz among rows of 100 Hz, 99 of 100 samples of the battery were lost."""
    t = np.arange(1600) / 100.0
    volts = np.where(t < 8.0, np.where(np.arange(1600) % 100 == 0, 4.0 - 0.01 * np.floor(t), np.nan), np.nan)
    height = np.where((np.arange(1600) % 10 == 0) & (t < 8.0), 0.8, np.nan)
    new = logs.resample(FlightLog({"t_s": t, "vbat_V": volts, "zrange_m": height}, {"source": "made"}), 50.0)
    logged = new["t_s"] < 12.0 - 1e-6  # the last one at 7 s, and 5 s more
    np.testing.assert_allclose(new["vbat_V"][logged], 4.0 - 0.01 * np.minimum(np.floor(new["t_s"][logged] + 1e-6), 7))
    assert np.isnan(new["vbat_V"][new["t_s"] > 12.01]).all()
    assert (new["zrange_m"][new["t_s"] < 8.0] == 0.8).all() and np.isnan(new["zrange_m"][new["t_s"] > 8.06]).all()


def test_impossible_requests_say_so():
    with pytest.raises(AirTouchError, match="not possible"):
        logs.resample(tone(1.0), 0)
    for clock in (np.zeros(5), np.full(5, np.nan), np.zeros(0)):
        with pytest.raises(AirTouchError, match="clock does not run"):
            logs.resample(FlightLog({"t_s": clock, "acc_x_mps2": np.zeros(len(clock))}, {"source": "made"}))
