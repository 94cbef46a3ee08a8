"""Slopes of the spectra by effects of the loop, of which nothing is linear: against differences of the likelihood."""

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.least_squares import limits
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.evidence.slopes import SpectraSlopes, active_at
from airtouch.gap.signatures.candidates import terms
from gap_flights import fly

LAG, MASS = terms("motor_lag")[0], terms("mass")[0]
MEAN = [LAG, MASS]
AT = np.array([*np.full(len(LAG.free), 1.0), 0.3])


@pytest.fixture(scope="module")
def problem(study):
    data = Data(study, fly(1, 72))
    return problem_of(data, whole_of(data))


@pytest.fixture
def slopes(problem):
    slopes = SpectraSlopes(problem, MEAN, limits(MEAN)[1])
    slopes.take(AT)
    return slopes


def central(function, which, step=0.01):
    """Central difference of a function of the scaled parameters."""
    change = step * np.eye(len(AT))[which]
    return (function(AT + change) - function(AT - change)) / (2.0 * step)


def test_slopes_of_the_loop_are_its_differences(problem, slopes):
    def torque_power(x):
        return problem.torque_power(active_at(MEAN, x))

    def log_ratio(x):
        return np.log(problem.data.study.loop.ratio(active_at(MEAN, x)))

    for kept, function in ((slopes.torque_powers, torque_power), (slopes.rises, log_ratio)):
        expected = central(function, 0)
        assert np.abs(expected).max() > 0.0
        assert np.abs(kept[0] - expected).max() < 0.1 * np.abs(expected).max()
    assert slopes.nonlinear[0] and not slopes.nonlinear[-1]


def test_slopes_of_the_loop_are_taken_anew_wherever_the_fit_stands(slopes):
    before = list(slopes.columns)
    slopes.take(AT + 0.01)
    assert [now is then for now, then in zip(slopes.columns, before, strict=True)] == (~slopes.nonlinear).tolist()
    np.testing.assert_array_equal(slopes.at, AT)


@pytest.mark.parametrize("wide", [False, True])
def test_gradient_by_the_power_is_that_of_the_likelihood(problem, slopes, wide):
    """The gap stays as it is: only the power that is expected of it changes."""
    values = problem.values(active_at(MEAN, AT))

    def level(x):
        power, cost = problem.loop_power(active_at(MEAN, x), wide)
        return problem.likelihood(values, power) - cost

    added, _ = problem.loop_power(active_at(MEAN, AT), wide)
    gradient, information = slopes.power_equations(AT, values, added, wide)
    for i in range(len(AT)):
        expected = central(level, i)
        assert gradient[i] == pytest.approx(expected, rel=0.03)
    assert abs(central(level, 0)) > 1.0
    np.testing.assert_allclose(information, information.T, rtol=1e-9)
    assert np.linalg.eigvalsh(information).min() > -1e-9 * information.max()
