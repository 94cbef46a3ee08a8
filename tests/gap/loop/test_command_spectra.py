"""The law of the commands' power, against SciPy's F distribution."""

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import approx_fprime

from airtouch.gap.loop.command_spectra import COMMAND_FREEDOM, log_likelihood, log_likelihood_slope, typical

SHAPE = (300, 5, 3)  # blocks, bins, axes
LAW = stats.f(2.0, 2.0 * COMMAND_FREEDOM)  # of the power over the expected one


@pytest.fixture
def made():
    """Expected power (bins, axes), and power (blocks, bins, axes) of that law."""
    rng = np.random.default_rng(2)
    expected = rng.uniform(0.5, 4.0, SHAPE[1:])
    return expected, expected * LAW.rvs(SHAPE, random_state=rng)


def test_the_power_over_the_expected_one_follows_the_f_distribution(made):
    expected, power = made
    assert log_likelihood(power, expected) == pytest.approx((LAW.logpdf(power / expected) - np.log(expected)).sum())


def test_the_slope_is_that_of_the_likelihood(made):
    expected, power = made

    def at(log_factor):
        return log_likelihood(power, expected * np.exp(log_factor.reshape(expected.shape)))

    numerical = approx_fprime(np.zeros(expected.size), at, 1e-6).reshape(expected.shape)
    np.testing.assert_allclose(log_likelihood_slope(power / expected, np.ones(expected.shape)), numerical, atol=0.01)


def test_the_typical_power_is_the_likeliest_and_hardly_follows_a_stray_block(made):
    expected, power = made
    estimate = typical(power)
    np.testing.assert_allclose(log_likelihood_slope(power / estimate, np.ones(estimate.shape)), 0.0, atol=1e-3)
    deviation = np.sqrt((COMMAND_FREEDOM + 2.0) / COMMAND_FREEDOM / len(power))  # of log power, by its information
    assert np.abs(np.log(estimate / expected)).max() < 3.5 * deviation
    stray = np.concatenate([power, 1000.0 * expected[None]])
    most = (COMMAND_FREEDOM + 1.0) / len(power)  # a value counts as much at most
    assert (typical(stray) < estimate * (1.0 + 1.5 * most)).all()
    assert (stray.mean(axis=0) > 3.0 * estimate).all()
