"""Faults of single channels, each against a plain loop over its definition."""

import numpy as np
import pytest

from airtouch.logs.checks import channel_faults
from airtouch.logs.flight_log import FlightLog
from airtouch.robust import MAD_TO_SIGMA


def log_of(columns, n=400):
    return FlightLog({"t_s": 0.01 * np.arange(n)} | columns, {"source": "made"})


@pytest.mark.parametrize("seed", range(20))
def test_spikes_are_the_samples_that_a_loop_finds(seed):
    rng = np.random.default_rng(seed)
    values = 0.02 * rng.normal(size=400)
    values[rng.integers(1, 399, 6)] += rng.choice([-1, 1], 6) * rng.uniform(0.1, 3.0, 6)
    values[rng.integers(0, 400, 3)] = np.nan
    values[200:] += 1.0  # a step is no spike
    steps = np.abs(np.diff(values))
    noise = np.nanmedian(steps[:-1])
    limit = max(0.3, 12.0 * MAD_TO_SIGMA * noise)
    expected = []
    for k in range(1, 399):
        rise, fall = values[k] - values[k - 1], values[k] - values[k + 1]
        if min(abs(rise), abs(fall)) > limit and rise * fall > 0 and abs(rise - fall) < limit / 3:
            expected.append(k)
    assert channel_faults.spikes(log_of({"zrange_m": values})).get("zrange_m", []) == expected


@pytest.mark.parametrize("seed", range(20))
def test_stuck_intervals_are_the_runs_that_a_loop_finds(seed):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=400)
    for start, length in zip(rng.integers(0, 330, 3), (40, 60, 70), strict=True):
        values[start:start + length] = rng.normal()
    flying = np.arange(400) >= rng.integers(0, 200)
    expected, start = [], 0
    for k in range(1, 401):
        if k == 400 or values[k] != values[k - 1] or not (flying[k] and flying[k - 1]):
            if k - start > 50:
                expected.append(("gyro_x_radps", start, k))
            start = k
    intervals = channel_faults.stuck_intervals(log_of({"gyro_x_radps": values}), flying)
    # 0.5 s to the bit is on the limit
    assert [interval for interval in intervals if interval[2] - interval[1] != 50] == expected


def test_a_channel_that_never_changes_is_stuck_on_the_ground_too():
    log = log_of({"vbat_V": np.full(400, 3.9), "acc_x_mps2": np.arange(400.0)})
    assert channel_faults.stuck_intervals(log, np.zeros(400, bool)) == [("vbat_V", 0, 400)]


def test_duplicates_are_the_pairs_whose_correlation_is_one():
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(2, 400))
    columns = {"gyro_x_radps": a, "gyro_y_radps": 3.0 - 2.0 * a, "gyro_z_radps": b, "m1_pwm": a + 1e-3 * b,
               "vbat_V": np.full(400, 3.9)}
    correlated = [(x, y) for i, x in enumerate(columns) for y in list(columns)[i + 1:]
                  if "vbat_V" not in (x, y) and abs(np.corrcoef(columns[x], columns[y])[0, 1]) > 1 - 1e-12]
    assert channel_faults.duplicates(log_of(columns)) == correlated == [("gyro_x_radps", "gyro_y_radps")]


def test_saturation_counts_samples_at_full_scale():
    rng = np.random.default_rng(4)
    pwm = rng.choice([100.0, 65534.0, 65535.0], 400)
    gyro = rng.choice([0.0, np.deg2rad(1990.0), -np.deg2rad(2000.0)], 400)
    assert channel_faults.saturation_counts(log_of({"m1_pwm": pwm, "gyro_x_radps": gyro, "acc_x_mps2": gyro})) == {
        "m1_pwm": sum(v == 65535 for v in pwm), "gyro_x_radps": sum(v < 0 for v in gyro)}
