"""Clocks that once ended in a traceback, or cost more than their samples: now a log or one clear line."""


import numpy as np
import pytest

from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.logs.checks import clock
from airtouch.logs.files import parse
from airtouch.logs.flight_log import FlightLog
from tools.fuzzing.log_fuzzing.hostile import table, usd
from tools.fuzzing.log_fuzzing.sound import motion, si_columns


def flying(n=200, **changed):
    return table({**si_columns(motion(n, 0.01, 0)), **changed})


def test_one_damaged_time_costs_its_own_sample_and_no_other():
    """A flipped bit in a time of a uSD log: 882 bytes once took 94 s and 4 GB."""
    times = 1000 * np.arange(40)
    for place in (0, 20, 39):
        for bit in (20, 30, 36, 50, 63):
            damaged = times.astype(np.uint64)
            damaged[place] ^= np.uint64(1 << bit)
            log = parse(usd(damaged), "log00")
            new = logs.resample(log, 1000.0)
            assert len(new) <= 10_000
            assert np.isfinite(new["acc_x_mps2"]).sum() >= 38
            if bit > 30:
                assert any("t_s: not of this flight" in w and "1 of 40" in w for w in log.meta["warnings"])


def test_a_wrong_time_among_the_others_does_not_take_the_rest_with_it():
    time = 0.01 * np.arange(300)
    time[100] += 2.5
    time[200] -= 1.5
    new = logs.resample(FlightLog({"t_s": time, "acc_x_mps2": np.arange(300.0)}, {"source": "made"}))
    np.testing.assert_allclose(new["acc_x_mps2"], np.arange(300.0), atol=1e-6)
    assert new.meta["resampled"]["left_out"] == 2
    assert any("2 of 300 samples" in w for w in new.meta["warnings"])


@pytest.mark.parametrize("error_s", [-1.0, -0.3, 1.0])
@pytest.mark.parametrize("length", [1, 3])
def test_a_wrong_time_is_no_loss_of_samples(error_s, length):
    """One time 1 s too early counted as 100 lost samples, and moved the rest of the flight by 1 s."""
    time = 0.01 * np.arange(600)
    time[300:300 + length] += error_s
    assert clock.lost_samples(time, 0.01) == []
    stated = FlightLog({"t_s": time, "acc_x_mps2": np.arange(600.0)}, {"source": "made", "sample_period_s": 0.01})
    np.testing.assert_array_equal(clock.regular_time(stated)[0], np.arange(600) * 0.01)
    time[400:] += 0.05  # a real loss behind it
    assert [(gap.sample, gap.lost) for gap in clock.lost_samples(time, 0.01)] == [(400, 5)]


def test_most_samples_in_order_are_kept():
    """Against all subsets of a few samples."""
    rng = np.random.default_rng(3)
    for _ in range(200):
        times = rng.integers(0, 6, 7).astype(float)
        times[rng.random(7) < 0.1] = np.nan
        rising = clock.rising_subsequence(times)
        assert (np.diff(times[rising]) > 0).all() and not np.isnan(times[rising]).any()
        subsets = [np.flatnonzero([bits >> i & 1 for i in range(7)]) for bits in range(128)]
        in_order = [s for s in subsets if (np.diff(times[s]) > 0).all() and not np.isnan(times[s]).any()]
        assert len(rising) == max(map(len, in_order))
        level = clock.rising_subsequence(times, repeats=True)
        assert (np.diff(times[level]) >= 0).all() and not np.isnan(times[level]).any()
        not_falling = [s for s in subsets if (np.diff(times[s]) >= 0).all() and not np.isnan(times[s]).any()]
        assert len(level) == max(map(len, not_falling))


def test_a_clock_that_is_not_in_seconds_is_refused_with_the_remedy():
    for scale in (1e3, 1e6, 1e9):
        with pytest.raises(AirTouchError, match="made: 1.* s from sample to sample.*give t_s in seconds"):
            parse(flying(t_s=3.0 + scale * 0.01 * np.arange(200)), "made")
    assert parse(flying(t_s=1.7e9 + 0.01 * np.arange(200)), "made").meta["warnings"] == parse(
        flying(), "made").meta["warnings"]  # seconds since 1970 are seconds


@pytest.mark.parametrize("steps", [1e-9, 1e-5, 1e-300])
def test_a_clock_faster_than_any_sensor_is_not_resampled(steps):
    """Steps of a nanosecond with pauses between: a grid of 30 million samples, MemoryError or LinAlgError."""
    log = parse(flying(t_s=np.cumsum(np.where(np.arange(200) > 190, 0.09 * (steps > 1e-200), steps))), "made")
    assert any("does not run" in w for w in logs.check(log).warnings)
    with pytest.raises(AirTouchError, match="clock does not run"):
        logs.resample(log)


def test_few_samples_over_a_long_time_are_refused():
    log = parse(flying(t_s=np.r_[0.001 * np.arange(199), 400.0]), "made")
    with pytest.raises(AirTouchError, match=r"made: 200 samples in 400 s would become 40\d* ?.*; correct t_s"):
        logs.resample(log, 1000.0)
    with pytest.raises(AirTouchError, match="more than 1 GiB"):
        zeros = np.zeros(3_000_000)
        logs.resample(FlightLog({"t_s": 0.01 * np.arange(3_000_000), "x_m": zeros, "y_m": zeros, "z_m": zeros}), 2000.0)


@pytest.mark.parametrize("period", ["5e-324", "1e-300", "1e308", "1e999", "-1", "0", "NaN", "true", '"0.01"', "[0.01]",
                                    "9" * 400])
def test_a_stated_period_that_cannot_be_is_left_out(period):
    """1 / 5e-324 was an OverflowError, 1e-300 a convolution as long as the log."""
    log = parse(f"# sample_period_s: {period}\n".encode() + flying(), "made")
    assert "sample_period_s" not in log.meta and any("sample_period_s" in w for w in log.meta["warnings"])
    assert logs.check(log).rate_hz == pytest.approx(100) and len(logs.segments(log)) > 3
    misstated = FlightLog(log.columns, {**log.meta, "sample_period_s": 5e-324})
    assert clock.sample_period(misstated) == pytest.approx(0.01)


def test_logs_made_in_memory_overflow_nowhere():
    n = 60
    for time in (np.full(n, 1e308), np.where(np.arange(n) % 2, 1e308, -1e308), np.full(n, 5e-324),
                 np.r_[0.01 * np.arange(n - 1), np.inf]):
        for meta in ({}, {"sample_period_s": 0.01}):
            log = FlightLog({"t_s": time, "zrange_m": np.ones(n)}, {"source": "made", "warnings": [], **meta})
            logs.check(log)
            try:
                assert len(logs.resample(log)) <= 10_000
            except AirTouchError as error:
                assert "clock" in str(error) or "would become" in str(error)


def test_rates_that_cannot_be_are_refused():
    log = parse(flying(), "made")
    for rate in (np.nan, 1e-300, 0.01, 1e5, -1.0):
        with pytest.raises(AirTouchError, match="not possible; give 0.2 to 10000 Hz"):
            logs.resample(log, rate)
