"""The fit of mean effects: on least squares of a known minimum, and against SciPy's minimum of the same posterior."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import PRIOR_STD
from airtouch.gap.evidence.gauss_newton import (
    COMMAND_PRIOR_STD,
    LEAST_PROMISE,
    LOOP_STARTS,
    MOST_ATTEMPTS,
    NEAR_NEUTRAL,
    Posterior,
    gauss_newton,
    start_of,
)
from airtouch.gap.evidence.likelihood import Likelihood
from airtouch.gap.evidence.problem import LoopChange, problem_of, whole_of
from airtouch.gap.signals.channels import COUNT
from airtouch.gap.signals.command_view import LikelihoodSlopes
from airtouch.gap.signatures.candidates import terms
from airtouch.gap.signatures.signature import MEAN
from hovers import FLOOR, hover

FORCE = np.array([0.3, -0.1, 0.2])  #: m/s^2, on every flight
SPREAD = np.zeros(COUNT)
SPREAD[:3] = 0.05  #: m/s^2, of the means of forces from flight to flight
BIAS = terms("imu_bias")[0]
GAUSSIAN = 1e7  #: degrees of freedom of tails that cannot be told from a normal law's
FLAT = 1e6  #: standard deviation of a prior that says nothing


@pytest.fixture(scope="module")
def problem():
    """Two hovers under a force; their means may differ."""
    study = replace(FLOOR, floor=replace(FLOOR.floor, offset=SPREAD))
    data = Data(study, [hover(i, FORCE + 0.02 * i, length_s=12.0, name=str(i)) for i in (1, 2)])
    return problem_of(data, whole_of(data))


def posterior_of(problem, spread):
    return Posterior(problem, [BIAS], 0.0, spread, uncertain_floor=False)


@pytest.mark.parametrize("spread", [PRIOR_STD, 0.5])
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
    posterior, k = posterior_of(problem, PRIOR_STD), len(BIAS.free)
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
    result = gauss_newton(Posterior(problem, [], 0.0, PRIOR_STD, uncertain_floor=False), np.zeros(0))
    assert not len(result.x) and result.residual is problem.elements.residual


def test_prior_of_what_only_the_commands_show_is_narrow(problem):
    """Of effects of the loop, beside one that shows in the replay."""
    gain = next(t for t in terms("controller_gain") if t.signature.loop_only)
    wide = Posterior(problem, [BIAS, gain], 0.0, PRIOR_STD, uncertain_floor=False).prior_stds
    narrow = Posterior(problem, [BIAS, gain], 0.0, 0.1, uncertain_floor=False).prior_stds
    k, n = len(BIAS.free), len(BIAS.free) + len(gain.free)
    assert (wide[:k] == PRIOR_STD).all() and (wide[k:n] == COMMAND_PRIOR_STD).all() and (narrow[:n] == 0.1).all()
    np.testing.assert_array_equal(wide[n:], [o.prior_std for o in problem.offsets])


class Commands:
    """A command view of `count` values, of which no parameter changes anything."""

    def __init__(self, count):
        self.count = count

    def __len__(self):
        return self.count

    def rise(self, before, after):
        return np.zeros((0, 4))

    def slopes(self, active, rises, uncertain_floor):
        return LikelihoodSlopes(np.zeros(len(rises)), np.zeros((len(rises), len(rises))))


def effect(k, low=-np.inf, high=np.inf, loop_only=False):
    """A mean effect of k parameters that is its scaled parameters."""
    return SimpleNamespace(free=tuple("abc"[:k]), shows_in=MEAN, signature=SimpleNamespace(loop_only=loop_only),
                           bounds=lambda: (np.full(k, low), np.full(k, high)), acts_when_neutral=True,
                           active=lambda x: x)


class LeastSquares:
    """A problem of the residual f(x) with a normal law: minus its log likelihood is |f(x)|^2 / 2 and a constant.

    linear: whether f is; power: the expected power at x; commands: how many values the command view has.
    """

    def __init__(self, f, k, linear=False, power=lambda x: 1.0, commands=0):
        self.f, self.power = f, power
        residual = np.asarray(f(np.zeros(k)), complex)
        one = np.ones(len(residual))
        self.likelihood = Likelihood(one, GAUSSIAN * one, GAUSSIAN * one, one > 0.0)
        self.elements = SimpleNamespace(residual=residual, floor_power=one, tail_scale=GAUSSIAN * one, valid=one > 0.0)
        self.offsets = []
        self.flat = SimpleNamespace(commands=Commands(commands), replay_count=0)
        self.data = SimpleNamespace(study=SimpleNamespace(loop=SimpleNamespace(same_loop=lambda *_: linear)))

    def residual(self, active):
        return np.asarray(self.f(active[0]), complex)

    def extra_torque_power(self, active):
        return np.zeros(0)

    def loop_change(self, active, uncertain_floor=False):
        return LoopChange((self.power(active[0]) - 1.0) * np.ones(len(self.elements.residual)), 0.0)


class Counted(Posterior):
    """A posterior that counts the points at which it is worked out."""

    points = 0

    def at(self, x, offsets):
        self.points += 1
        return super().at(x, offsets)


def counted_posterior_of(problem, term, prior_std=FLAT):
    return Counted(problem, [term], 0.0, prior_std, uncertain_floor=False)


def rosenbrock(x):
    """A hundred times Rosenbrock's valley (1960) as least squares: its only minimum is 0 at (1, 1).

    At the start (-1.2, 1) it costs 121 000 nats, beside which LEAST_STEP_GAIN is little.
    """
    return 100.0 * np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])


def test_a_linear_problem_is_solved_by_one_step_and_ends_with_the_next():
    """Against NumPy's least squares. Of a hundred steps that are allowed the second finds nothing and is the last."""
    rng = np.random.default_rng(0)
    rows, aim = rng.normal(size=(20, 3)), 5.0 * rng.normal(size=20)
    posterior = counted_posterior_of(LeastSquares(lambda x: rows @ x - aim, 3, linear=True), effect(3))
    result = gauss_newton(posterior, np.full(3, NEAR_NEUTRAL), most=100)
    np.testing.assert_allclose(result.x, np.linalg.lstsq(rows, aim, rcond=None)[0], rtol=1e-5)
    np.testing.assert_allclose(result.covariance, np.linalg.inv(rows.T @ rows), rtol=1e-5)
    assert posterior.points <= 2 + 2 * MOST_ATTEMPTS


def test_a_prior_draws_the_minimum_to_neutral_as_in_ridge_regression():
    problem = LeastSquares(lambda x: x - 3.0, 1, linear=True)
    result = gauss_newton(counted_posterior_of(problem, effect(1), 0.5), np.zeros(1))
    assert result.x == pytest.approx([3.0 / (1.0 + 1.0 / 0.5 ** 2)], rel=1e-6)


def test_a_step_that_promises_too_little_is_not_tried():
    """Of f(x) = x^2 each step halves x; its equations are those of a line, and promise all of the cost, x^4 / 2.

    From 3.5 on they promise 75, 4.7, 0.29, 0.018, 0.0011 nats, of which only the last is less than LEAST_PROMISE.
    """
    halvings = [3.5 * 0.5 ** i for i in range(8)]
    steps = next(i for i, x in enumerate(halvings) if 0.5 * x ** 4 < LEAST_PROMISE)
    assert steps == 4
    posterior = counted_posterior_of(LeastSquares(lambda x: x ** 2, 1), effect(1))
    result = gauss_newton(posterior, np.full(1, 3.5), most=100)
    assert result.x == pytest.approx([halvings[steps]], rel=0.1) and posterior.points == 1 + steps


def test_slopes_that_point_the_wrong_way_are_taken_anew():
    """The first step passes the minimum at 1, beyond which the kept slope has the wrong sign: all attempts fail."""
    problem = LeastSquares(lambda x: 1000.0 * (100.0 * (x - 1.0) ** 2 + 1.0), 1, linear=True)
    begin = np.full(1, 0.9)
    passed, stuck, result = (gauss_newton(counted_posterior_of(problem, effect(1)), begin, n).x for n in (1, 2, 100))
    assert passed > 1.005 and stuck == passed and result == pytest.approx([1.0], abs=2e-3)


def test_a_curved_valley_is_followed_to_its_end():
    posterior = counted_posterior_of(LeastSquares(rosenbrock, 2), effect(2))
    result = gauss_newton(posterior, np.array([-1.2, 1.0]), most=200)
    assert result.x == pytest.approx([1.0, 1.0], abs=1e-3)


def test_no_step_is_worse_than_the_one_before():
    posterior, start = counted_posterior_of(LeastSquares(rosenbrock, 2), effect(2)), np.array([-1.2, 1.0])
    costs = [0.5 * np.sum(np.square(rosenbrock(gauss_newton(posterior, start, most).x))) for most in range(20)]
    assert costs[0] == pytest.approx(121_000.0) and (np.diff(costs) <= 0.0).all()


def test_the_minimum_within_bounds_is_at_the_bound():
    problem = LeastSquares(lambda x: np.array([x[0] - 5.0, x[0] + x[1] - 1.0]), 2, linear=True)
    result = gauss_newton(counted_posterior_of(problem, effect(2, high=2.0)), np.zeros(2))
    assert result.x == pytest.approx([2.0, -1.0], abs=1e-6)


def loop_problem(likeliest, k=1):
    """Of a residual of power 1 the likelihood is highest where exp(x - likeliest), of the last parameter x, is 1."""
    return LeastSquares(lambda x: np.ones(50), k, power=lambda x: np.exp(x[-1] - likeliest), commands=1)


@pytest.mark.parametrize(("likeliest", "begin"), [
    (LOOP_STARTS[1], LOOP_STARTS[1]), (-1.3, -1.0), (0.6, 0.5), (9.0, 3.0), (-9.0, -2.0), (NEAR_NEUTRAL, NEAR_NEUTRAL)])
def test_an_effect_of_the_loop_begins_at_the_likeliest_point_of_the_grid(likeliest, begin):
    """The log likelihood falls by d + exp(-d) - 1 on either side, d = x - likeliest."""
    d = np.array(LOOP_STARTS) - likeliest
    assert LOOP_STARTS[int(np.argmin(d + np.exp(-d)))] == begin
    assert start_of(loop_problem(likeliest), [effect(1, loop_only=True)], None) == [begin]


def test_the_grid_moves_one_parameter_within_its_bounds_where_nothing_is_known():
    loop = effect(2, loop_only=True)
    assert start_of(loop_problem(-1.0, 2), [loop], None).tolist() == [NEAR_NEUTRAL, -1.0]
    bounded = effect(2, low=-0.7, loop_only=True)
    assert start_of(loop_problem(-9.0, 2), [bounded], None).tolist() == [NEAR_NEUTRAL, -0.7]
    assert start_of(loop_problem(-1.0, 2), [loop], np.array([0.4, np.nan])).tolist() == [0.4, NEAR_NEUTRAL]
    assert start_of(loop_problem(-1.0), [effect(1)], None) == [NEAR_NEUTRAL], "an effect that the replay shows"
    without_commands = LeastSquares(lambda x: np.ones(50), 1, power=lambda x: np.exp(x[-1] + 1.0))
    assert start_of(without_commands, [effect(1, loop_only=True)], None) == [NEAR_NEUTRAL]
