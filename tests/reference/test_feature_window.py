"""Both normalisations against SciPy and against explicit weights."""

import numpy as np
import pytest
from scipy.stats import zscore

from airtouch.errors import AirTouchError
from airtouch.reference import streaming_z_score, z_score_window
from airtouch.reference.feature_window import deviation_from_mean


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
    for call, message in ((lambda: streaming_z_score(np.zeros((3, 1)), 0.0), "time constant must be positive, not 0.0"),
                          (lambda: z_score_window(np.zeros(4)), r"not \(4,\)"),
                          (lambda: streaming_z_score(np.zeros(3), 5.0), r"not \(3,\)"),
                          (lambda: z_score_window(np.zeros((0, 3))), r"not \(0, 3\)"),
                          (lambda: deviation_from_mean(np.zeros(3), 0.0), "time constant must be positive, not 0.0")):
        with pytest.raises(AirTouchError, match=message):
            call()


def test_of_two_samples_the_second_lies_by_its_weight_from_both():
    """Weights w and 1, w = exp(-1 / tau), tau less than a sample.

    Of 0 and d the last lies w / (1 + w) d from the mean, and the deviation is sqrt(w) / (1 + w) d.
    """
    tau = 0.5
    weight = np.exp(-1.0 / tau)
    np.testing.assert_allclose(streaming_z_score(np.array([[3.0], [10.0]]), tau)[:, 0], [0.0, np.sqrt(weight)])
    np.testing.assert_allclose(deviation_from_mean(np.array([3.0, 10.0, 10.0]), tau),
                               [0.0, 7.0, 10.0 - (10.0 + 3.0 * weight) / (1.0 + weight)])
