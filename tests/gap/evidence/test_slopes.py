"""Slopes of the spectra: of a linear effect, its differences; of effects of the loop, those of the likelihood."""

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.evidence.slopes import LARGEST_MOVE, active_at, slopes_at
from airtouch.gap.signatures.candidates import terms
from gap_flights import fly
from hovers import FLOOR, hover

LAG, MASS, BIAS = (terms(name)[0] for name in ("motor_lag", "mass", "imu_bias"))
MEAN = [LAG, MASS]
AT = np.array([*np.full(len(LAG.free), 1.0), 0.3])


@pytest.fixture(scope="module")
def problem(study):
    data = Data(study, fly(1, 72))
    return problem_of(data, whole_of(data))


@pytest.fixture
def slopes(problem):
    return slopes_at(problem, MEAN, AT)


def central(function, which, step=0.01):
    """Central difference of a function of the scaled parameters."""
    change = step * np.eye(len(AT))[which]
    return (function(AT + change) - function(AT - change)) / (2.0 * step)


def test_slopes_of_the_loop_are_its_differences(problem, slopes):
    def extra_torque_power(x):
        return problem.extra_torque_power(active_at(MEAN, x))

    def log_ratio(x):
        return np.log(problem.data.study.loop.ratio(active_at(MEAN, x)))

    lag, mass = slopes.by_parameter[0], slopes.by_parameter[-1]
    for slope, function in ((lag.extra_torque_power, extra_torque_power), (lag.rise, log_ratio)):
        expected = central(function, 0)
        assert np.abs(expected).max() > 0.0
        assert np.abs(slope - expected).max() < 0.1 * np.abs(expected).max()
    assert lag.nonlinear and not mass.nonlinear


def test_slopes_of_the_loop_are_taken_anew_wherever_the_fit_stands(slopes):
    moved = slopes.moved_to(AT + 0.01)
    for now, then in zip(moved.by_parameter, slopes.by_parameter, strict=True):
        assert (now is then) is not then.nonlinear
    np.testing.assert_array_equal(moved.at, AT)


@pytest.mark.parametrize("uncertain_floor", [False, True])
def test_gradient_by_the_power_is_that_of_the_likelihood(problem, slopes, uncertain_floor):
    """The gap stays as it is: only the power that is expected of it changes."""
    residual = problem.residual(active_at(MEAN, AT))

    def level(x):
        of_loop = problem.loop_change(active_at(MEAN, x), uncertain_floor)
        return problem.likelihood(residual, of_loop.extra_power) - of_loop.cost

    added = problem.loop_change(active_at(MEAN, AT), uncertain_floor).extra_power
    gradient, information = slopes.power_slopes(AT, residual, added, uncertain_floor)
    for i in range(len(AT)):
        expected = central(level, i)
        assert gradient[i] == pytest.approx(expected, rel=0.03)
    assert abs(central(level, 0)) > 1.0
    np.testing.assert_allclose(information, information.T, rtol=1e-9)
    assert np.linalg.eigvalsh(information).min() > -1e-9 * information.max()


@pytest.fixture(scope="module")
def still():
    """A hover without a loop."""
    data = Data(FLOOR, [hover(1, length_s=12.0)])
    return problem_of(data, whole_of(data))


def test_slopes_of_a_linear_effect_are_its_differences(still):
    x = np.zeros(len(BIAS.free))
    for i, slope in enumerate(slopes_at(still, [BIAS], x).by_parameter):
        one = x.copy()
        one[i] = 1.0
        change = still.residual(active_at([BIAS], one)) - still.residual(active_at([BIAS], x))
        np.testing.assert_allclose(slope.column, change, atol=1e-6 * np.abs(change).max())
        assert not slope.nonlinear and not slope.extra_torque_power.any()


def test_slopes_of_a_linear_effect_are_kept_until_the_fit_has_moved_far(still):
    begun = slopes_at(still, [BIAS], np.zeros(len(BIAS.free)))
    for distance, anew in ((0.9 * LARGEST_MOVE, False), (1.1 * LARGEST_MOVE, True)):
        moved = begun.moved_to(np.full(len(BIAS.free), distance))
        assert (moved.by_parameter[0] is not begun.by_parameter[0]) is anew and np.all(moved.at == distance * anew)
    assert begun.moved_to(begun.at, anew=True).by_parameter[0] is not begun.by_parameter[0]
