"""The fit of mean effects: against SciPy's minimum of the same posterior, its curvature, and where it begins."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import PRIOR_UNITS
from airtouch.gap.evidence.gauss_newton import COMMAND_PRIOR, NEAR_NEUTRAL, Posterior, gauss_newton, start_of
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.signals.channels import COUNT
from airtouch.gap.signatures.candidates import terms
from hovers import FLOOR, hover

FORCE = np.array([0.3, -0.1, 0.2])  #: m/s^2, on every flight
SPREAD = np.zeros(COUNT)
SPREAD[:3] = 0.05  #: m/s^2, of the means of forces from flight to flight
BIAS = terms("imu_bias")[0]


@pytest.fixture(scope="module")
def problem():
    """Two hovers under a force; their means may differ."""
    study = replace(FLOOR, floor=replace(FLOOR.floor, offset=SPREAD))
    data = Data(study, [hover(i, FORCE + 0.02 * i, length_s=12.0, name=str(i)) for i in (1, 2)])
    return problem_of(data, whole_of(data))


def posterior_of(problem, spread):
    return Posterior(problem, [BIAS], 0.0, spread, uncertain_floor=False)


@pytest.mark.parametrize("spread", [PRIOR_UNITS, 0.5])
def test_fit_ends_where_the_posterior_of_parameters_and_offsets_is_highest(problem, spread):
    """A narrow prior holds the parameters back, and the offsets take what is left."""
    posterior, k = posterior_of(problem, spread), len(BIAS.free)
    result = gauss_newton(posterior, np.full(k, NEAR_NEUTRAL))

    def cost(both):
        return posterior.at(both[:k], both[k:]).cost

    best = minimize(cost, np.concatenate([result.x, np.zeros(len(problem.offsets))]), method="BFGS")
    offsets_alone = minimize(lambda o: cost(np.concatenate([result.x, o])), np.zeros(len(problem.offsets)))
    assert offsets_alone.fun < best.fun + 0.05, "nats, of those that a further step would gain"
    np.testing.assert_allclose(result.x, best.x[:k], atol=0.3 * np.sqrt(np.diag(result.covariance)).max())


def test_covariance_is_the_inverse_curvature_of_the_posterior(problem):
    """By second differences in the first parameter, all else at its best: the profile of the posterior."""
    posterior, k = posterior_of(problem, PRIOR_UNITS), len(BIAS.free)
    result = gauss_newton(posterior, np.full(k, NEAR_NEUTRAL))
    step = np.sqrt(result.covariance[0, 0])

    def profile(first):
        rest = minimize(lambda r: posterior.at(np.concatenate([[first], r[:k - 1]]), r[k - 1:]).cost,
                        np.concatenate([result.x[1:], np.zeros(len(problem.offsets))]), method="BFGS")
        return rest.fun

    curvature = (profile(result.x[0] + step) - 2.0 * profile(result.x[0]) + profile(result.x[0] - step)) / step ** 2
    assert 1.0 / curvature == pytest.approx(result.covariance[0, 0], rel=0.15)


def test_fit_begins_close_to_neutral_or_at_what_is_known(problem):
    known = np.array([np.nan, 2.0, np.nan, -1.0, np.nan, 0.0])
    np.testing.assert_array_equal(start_of(problem, [BIAS], None), np.full(6, NEAR_NEUTRAL))
    np.testing.assert_array_equal(start_of(problem, [BIAS], known), np.where(np.isnan(known), NEAR_NEUTRAL, known))


def test_without_effects_and_offsets_nothing_is_fitted():
    data = Data(FLOOR, [hover(1, length_s=8.0)])
    problem = problem_of(data, whole_of(data))
    result = gauss_newton(Posterior(problem, [], 0.0, PRIOR_UNITS, uncertain_floor=False), np.zeros(0))
    assert not len(result.x) and result.values is problem.elements.base


def test_prior_of_what_only_the_commands_show_is_narrow(problem):
    """Of effects of the loop, beside one that shows in the replay."""
    gain = next(t for t in terms("controller_gain") if t.signature.loop_only)
    wide = Posterior(problem, [BIAS, gain], 0.0, PRIOR_UNITS, uncertain_floor=False).prior
    narrow = Posterior(problem, [BIAS, gain], 0.0, 0.1, uncertain_floor=False).prior
    k, n = len(BIAS.free), len(BIAS.free) + len(gain.free)
    assert (wide[:k] == PRIOR_UNITS).all() and (wide[k:n] == COMMAND_PRIOR).all() and (narrow[:n] == 0.1).all()
    np.testing.assert_array_equal(wide[n:], [o.spread for o in problem.offsets])
