"""The likelihood of one class against the normal density and an integral over its strengths."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import multivariate_normal

from airtouch.gap.relations.density import fit, log_density, principal, rescaling_of, unchanged
from airtouch.gap.relations.effect_class import EffectClass

Q = 6
KNOTS = np.log([0.1, 1.0, 10.0])


NONE = np.zeros((Q, 0)), np.zeros(0)


def straight(way, axes=NONE[0], variances=NONE[1], signed=False):
    """A class whose shift is its strength times `way` (Q,)."""
    table = np.tile(way, (1, len(KNOTS), 1))
    return EffectClass("one", "one", None, 1, signed, KNOTS,
                       np.concatenate([table, np.zeros_like(table)]) if signed else table, axes, variances)


@pytest.fixture
def way():
    return np.random.default_rng(3).normal(size=Q)


def test_the_likeliest_strength_of_a_straight_line_is_the_projection(way):
    values = 2.0 * way + np.random.default_rng(4).normal(size=Q)
    result = fit(straight(way), values, unchanged(Q))
    assert result.strength == pytest.approx([way @ values / (way @ way)], rel=1e-3)
    assert result.log_peak == pytest.approx(-0.5 * np.sum((values - result.strength * way) ** 2), rel=1e-6)


@pytest.mark.parametrize("signed", [False, True])
def test_the_marginal_likelihood_is_the_likelihood_averaged_over_strengths(way, signed):
    """Laplace's method against the integral: any strength as likely on a logarithmic scale, either sign too."""
    values = 3.0 * way

    def density(log_strength):
        signs = (-1.0, 1.0) if signed else (1.0,)
        return np.mean([np.exp(log_density(values - s * np.exp(log_strength) * way)) for s in signs])

    exact = np.log(quad(density, KNOTS[0], KNOTS[-1], points=[np.log(3.0)], limit=200)[0] / (KNOTS[-1] - KNOTS[0]))
    assert fit(straight(way, signed=signed), values, unchanged(Q)).log_marginal == pytest.approx(exact, abs=0.05)


def test_scatter_about_the_curve_widens_the_density(way):
    """Against SciPy's normal density with the covariance 1 + shift^2 axes variances axes'."""
    rng = np.random.default_rng(5)
    axes = np.linalg.qr(rng.normal(size=(Q, 2)))[0]
    variances, values = np.array([0.3, 0.05]), 2.0 * way + rng.normal(size=Q)
    result = fit(straight(way, axes, variances), values, unchanged(Q))
    shift = result.strength * way
    covariance = np.eye(Q) + (shift @ shift) * (axes * variances) @ axes.T
    constant = 0.5 * Q * np.log(2.0 * np.pi)
    assert result.log_peak == pytest.approx(multivariate_normal(shift, covariance).logpdf(values) + constant)


def test_a_rescaling_turns_a_covariance_into_one():
    rng = np.random.default_rng(6)
    loadings, values = rng.normal(size=(Q, 2)), rng.normal(size=Q)
    rescaling = rescaling_of(loadings)
    exact = multivariate_normal(np.zeros(Q), np.eye(Q) + loadings @ loadings.T).logpdf(values)
    constant = 0.5 * Q * np.log(2.0 * np.pi)
    assert rescaling.log_determinant + log_density(rescaling(values)) == pytest.approx(exact + constant)


def test_several_parameters_are_solved_together():
    """A plane: the least squares solution, within what was flown."""
    rng = np.random.default_rng(7)
    plane = rng.normal(size=(2, Q))
    of = EffectClass("two", "two", None, 2, False, KNOTS, np.repeat(plane[:, None], len(KNOTS), axis=1),
                     np.zeros((Q, 0)), np.zeros(0))
    values = np.array([1.5, -0.7]) @ plane + 0.1 * rng.normal(size=Q)
    assert fit(of, values, unchanged(Q)).strength == pytest.approx(np.linalg.lstsq(plane.T, values)[0], abs=1e-3)


def test_several_parameters_of_a_flight_without_a_shift_are_of_the_least_magnitude():
    """Least squares gives 0 there, where the curve has no slope."""
    of = EffectClass("two", "two", None, 2, False, KNOTS, np.repeat(np.eye(Q)[:2, None], len(KNOTS), axis=1),
                     np.zeros((Q, 0)), np.zeros(0))
    result = fit(of, np.zeros(Q), unchanged(Q))
    assert np.linalg.norm(result.strength) == pytest.approx(of.least)
    assert np.isfinite(result.log_marginal)


def test_principal_axes_are_those_of_a_singular_value_decomposition():
    """Two of six loadings are the same: an axis without variance counts for nothing."""
    loadings = np.random.default_rng(5).normal(size=(40, 6)) * np.array([1e3, 10.0, 1.0, 0.1, 1.0, 1.0])
    loadings[:, 5] = loadings[:, 4]
    axes, variance = principal(loadings)
    assert np.sort(variance)[1:] == pytest.approx(np.sort(np.linalg.svd(loadings)[1] ** 2)[1:], rel=1e-6)
    assert variance.min() == pytest.approx(0.0, abs=1e-9)
    assert (axes * variance) @ axes.T == pytest.approx(loadings @ loadings.T, rel=1e-9, abs=1e-9)
    assert principal(np.zeros((40, 0)))[0].shape == (40, 0)
