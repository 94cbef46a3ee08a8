"""Both normalisations against SciPy and against explicit weights."""

import numpy as np
import pytest
from scipy.stats import zscore

from airtouch.errors import AirTouchError
from airtouch.reference import streaming_z_score, z_score_window


def test_per_window_is_scipys_zscore():
    windows = np.random.default_rng(0).lognormal(5, 4, size=(7, 100, 3))
    np.testing.assert_allclose(z_score_window(windows), zscore(windows, axis=1), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("value", [0.0, 0.1, 1e14, 1e-40])
def test_a_constant_column_gives_zeros(value):
    window = np.random.default_rng(0).normal(size=(100, 2))
    window[:, 1] = value
    assert (z_score_window(window)[:, 1] == 0).all()
    assert (streaming_z_score(window, 30.0)[:, 1] == 0).all()


def test_streaming_is_the_weighted_mean_and_deviation_of_all_before():
    x, tau = np.random.default_rng(1).normal(5, 2, size=300), 40.0
    ours = streaming_z_score(x[:, None], tau)[:, 0]
    for i in range(1, 300):
        weight = np.exp(-np.arange(i, -1, -1) / tau)
        mean = np.average(x[:i + 1], weights=weight)
        std = np.sqrt(np.average((x[:i + 1] - mean) ** 2, weights=weight))
        assert ours[i] == pytest.approx((x[i] - mean) / std, rel=1e-9, abs=1e-9)


def test_streaming_starts_at_the_first_finite_sample():
    x = np.random.default_rng(2).normal(size=(50, 1))
    late = np.concatenate([np.full((20, 1), np.nan), x])
    np.testing.assert_array_equal(streaming_z_score(late, 10.0)[20:], streaming_z_score(x, 10.0))
    assert (streaming_z_score(late, 10.0)[:20] == 0).all()


def test_bad_input_is_refused():
    for call in (lambda: streaming_z_score(np.zeros((3, 1)), 0.0), lambda: z_score_window(np.zeros(4)),
                 lambda: streaming_z_score(np.zeros(3), 5.0), lambda: z_score_window(np.zeros((0, 3)))):
        with pytest.raises(AirTouchError):
            call()
