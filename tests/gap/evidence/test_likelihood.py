"""The compiled sum against the same sum by NumPy, and the likelihood that it is the sum of."""

import numpy as np
import pytest
from scipy.integrate import quad

from airtouch.gap.evidence.likelihood import Likelihood, minus_log_likelihood, tail_scale
from airtouch.gap.loop.command_spectra import COMMAND_FREEDOM, log_likelihood


@pytest.mark.parametrize("decades", [(-3.0, 3.0), (-60.0, -40.0), (40.0, 60.0)])
def test_the_sum_is_numpys(decades):
    rng = np.random.default_rng(5)
    power = 10.0 ** rng.uniform(*decades, 3000)
    size = power * rng.exponential(3.0, 3000) ** 4
    exponents = np.repeat([13.0, 7.0, 13.0], 1000)
    valid = rng.random(3000) > 0.1
    expected = np.where(valid, np.log(power) + exponents * np.log1p(size / power / 12.0), 0.0).sum()
    total = minus_log_likelihood(size, power, np.full(3000, 12.0), exponents, valid)
    assert total == pytest.approx(expected, rel=1e-14)


def test_with_the_tails_of_commands_it_is_the_law_that_corrects_their_floor():
    """The two must not part: a fit takes its slopes of commands from the one and its level from the other."""
    rng = np.random.default_rng(6)
    expected = rng.uniform(0.5, 2.0, (50, 3))
    power = expected * rng.exponential(size=(8, 50, 3))
    nu, each = np.full(power.size, COMMAND_FREEDOM), np.broadcast_to(expected, power.shape).ravel()
    total = minus_log_likelihood(power.ravel(), each, nu, nu + 1.0, np.ones(power.size, bool))
    assert log_likelihood(power, expected) == pytest.approx(-total, rel=1e-12)


def test_no_value_gives_nothing():
    assert minus_log_likelihood(*np.zeros((4, 0)), np.zeros(0, bool)) == 0.0


@pytest.fixture
def law():
    """Values (200,), some of them unknown, and their likelihood."""
    rng = np.random.default_rng(3)
    power, freedom, valid = rng.uniform(0.5, 2.0, 200), np.repeat([12.0, 6.0], 100), rng.random(200) > 0.2
    values = np.sqrt(power / 2.0) * (rng.normal(size=200) + 1j * rng.normal(size=200))
    return Likelihood(power, freedom, tail_scale(freedom), valid), values


def test_the_likelihood_of_all_values_is_the_sum_of_that_of_each(law):
    likelihood, values = law
    each = likelihood.per_value(values, 0.3)
    assert likelihood(values, 0.3) == pytest.approx(each.sum()) and not each[~likelihood.valid].any()


@pytest.mark.parametrize("x", [0.0, 0.7, 20.0])
def test_along_one_power_it_is_that_of_this_power_and_the_others(law, x):
    likelihood, values = law
    unit, others = np.where(np.arange(200) % 3 == 0, 0.5, 0.0), np.full(200, 0.1)
    at = likelihood.along(np.abs(values) ** 2, others, unit)
    assert at(x) == pytest.approx(likelihood(values, others + x * unit), rel=1e-12)


def test_its_slope_by_the_power_is_that_of_small_changes(law):
    likelihood, values = law
    added, small = np.full(200, 0.2), 1e-5
    slope, curvature = likelihood.power_slopes(values, added, 150)
    step = [likelihood.per_value(values, added + sign * small) for sign in (1.0, -1.0)]
    np.testing.assert_allclose(slope, ((step[0] - step[1]) / (2.0 * small))[:150], atol=1e-6)
    assert len(slope) == len(curvature) == 150 and (curvature[likelihood.valid[:150]] > 0.0).all()


def expected_curvature(likelihood, density, power):
    """Mean of minus the second derivative of the log likelihood by the power (1,), by differences and quadrature."""
    small = 1e-3 * power

    def weighted(over):
        levels = [likelihood.per_value(np.sqrt([over * power]) + 0j, np.array([x]))[0] for x in (-small, 0.0, small)]
        return density(over) * (2.0 * levels[1] - levels[0] - levels[2]) / small ** 2

    return quad(weighted, 0.0, np.inf, limit=200)[0]


@pytest.mark.parametrize(("freedom", "of_exponential"), [(2.0, 0.55), (6.0, 0.77), (12.0, 0.86)])
def test_its_curvature_by_the_power_is_that_expected_without_tails(freedom, of_exponential):
    """That of the law with tails is nu / (nu + 2) of it, and but little more where power is exponential."""
    power, nu = 3.0, np.full(1, freedom)

    def law(tail):
        return Likelihood(np.full(1, power), nu, np.full(1, tail), np.ones(1, bool))

    _, (curvature,) = law(freedom).power_slopes(np.ones(1, complex), np.zeros(1), 1)

    def exponential(over):
        return np.exp(-over)

    hardly_any = Likelihood(np.full(1, power), np.full(1, 1e7), np.full(1, 1e7), np.ones(1, bool))
    assert curvature == pytest.approx(expected_curvature(hardly_any, exponential, power), rel=1e-3)
    with_tails = expected_curvature(law(freedom), lambda over: (1.0 + over / freedom) ** -(freedom + 1.0), power)
    assert with_tails / curvature == pytest.approx(freedom / (freedom + 2.0), rel=1e-3)
    scaled = expected_curvature(law(tail_scale(nu)[0]), exponential, power)
    assert scaled / curvature == pytest.approx(of_exponential, abs=0.005)


@pytest.mark.parametrize("freedom", [2.0, 6.0, 12.0])
def test_tails_are_scaled_so_that_the_expected_power_is_the_likeliest(freedom):
    """Of exponential power e of mean 1, by quadrature."""
    scale, = tail_scale(np.array([freedom]))
    mean, _ = quad(lambda e: np.exp(-e) * (freedom + 1.0) * e / (scale + e), 0.0, np.inf)
    assert mean == pytest.approx(1.0, abs=1e-6)
