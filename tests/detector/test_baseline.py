"""The baseline's parts against SciPy, NumPy and closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import periodogram
from scipy.signal.windows import hann

from airtouch.detector.baseline import Baseline, correlation_sum, derivative, extrema, fit, load, run, spectrum_power
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import ACC_WORLD, GYRO, PWM, FlightLog


def noisy_log(seed=0, n=900):
    rng = np.random.default_rng(seed)
    columns = {name: rng.normal(size=n) for name in ACC_WORLD + GYRO}
    columns |= {name: 45000 + 800 * rng.normal(size=n) for name in PWM}
    return FlightLog(columns, {"source": "noise", "sample_period_s": 0.01})


def test_power_is_the_whole_stft_spectrum():
    log = noisy_log()
    power = spectrum_power(log)
    gyro = log["gyro_y_radps"]
    frequency, psd = periodogram(gyro[-200:], 100.0, window=hann(200, sym=False), detrend="constant")
    assert power[-1, 4] == pytest.approx(psd[1:].sum() * frequency[1], rel=1e-4)


def test_correlation_sum_is_the_sum_over_pairs():
    power = np.random.default_rng(3).exponential(size=(160, 9))
    power[:20] = np.nan
    correlation = correlation_sum(power, 60)
    assert np.isnan(correlation[:79]).all() and np.isfinite(correlation[79:]).all()
    matrix = np.corrcoef(power[100:160].T)
    assert correlation[-1] == pytest.approx(matrix[np.triu_indices(9, 1)].sum(), abs=1e-9)


def test_a_constant_channel_correlates_with_none():
    power = np.random.default_rng(4).exponential(size=(80, 3))
    power[:, 2] = 7.0
    assert correlation_sum(power, 80)[-1] == pytest.approx(np.corrcoef(power[:, 0], power[:, 1])[0, 1])


def test_derivative_of_a_ramp_is_its_slope():
    slope = derivative(np.r_[np.full(5, np.nan), 3.0 * 0.01 * np.arange(200)], 25)
    assert np.isnan(slope[:54]).all()
    assert slope[54:] == pytest.approx(3.0)


@given(st.integers(30, 60), st.sampled_from([-1.0, 1.0]))
def test_a_bump_in_the_derivative_is_one_edge_one_sample_late(centre, sign):
    slope = sign * 10 * np.exp(-0.5 * ((np.arange(100) - centre) / 5.0) ** 2)
    assert extrema(slope, 5.0).tolist() == [centre + 1]
    assert extrema(slope, 11.0).tolist() == []


def test_edges_do_not_depend_on_later_samples():
    log = noisy_log(5)
    model = Baseline(threshold=2.0)
    edges = run(log, model).edges
    assert edges and [e.sample for e in run(log.slice(0, 600), model).edges] == [
        e.sample for e in edges if e.sample < 600]


@pytest.mark.parametrize("option", ["epochs", "steps", "free_air"])
def test_it_takes_no_option_of_a_network(option):
    with pytest.raises(TypeError, match=option):
        fit([noisy_log()], seed=1, **{option: 3})


def test_it_takes_no_model_file(tmp_path):
    assert load(None) == Baseline()
    with pytest.raises(AirTouchError, match="takes no model"):
        load(tmp_path / "m.npz")
