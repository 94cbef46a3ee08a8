"""Parameters of named effects with their errors: coverage on made data, and closed forms of each part of a variance."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import binom, norm

from airtouch.gap.answer.estimates import (
    LOOP_ERROR,
    REPLAY_ERROR,
    SPECTRUM_ERROR,
    Estimate,
    from_spectra,
    from_times,
    model_error,
    with_reading,
)
from airtouch.gap.answer.named_effects import named_effects
from airtouch.gap.evidence.clock import CORRELATION_S, measured_clock_term
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import FittedTerms, fit, mean_parameters
from airtouch.gap.evidence.likelihood import REPLAY_FREEDOM, tail_scale
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.evidence.random_strength import strength_variance
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.naming.judging import halves
from airtouch.gap.naming.policy import policy_of
from airtouch.gap.naming.records import Hypothesis, NamelessGain, Selection, Step
from airtouch.gap.relations.readout import Reading
from airtouch.gap.signatures.candidates import terms
from hovers import FLOOR, hover

BIAS = np.array([0.3, -0.1, 0.2])  #: m/s^2, of the accelerometer of every made hover
BIAS_NAMES = ("acc_x", "acc_y", "acc_z")
REPEATS = 60  #: flights, each with three intervals: of 180 a tenth too few or too many is beyond chance


def within_scatter(held, expected):
    """Whether so many of made intervals hold the truth as a binomial of that probability has, but for one in 1000."""
    low, high = binom.interval(0.999, len(held), expected)
    return low <= np.sum(held) <= high


def true_over_fitted_variance():
    """Variance of a fitted constant over that of the fit's covariance, on white noise of the expected power.

    The likelihood's tails: an M-estimator (Huber 1964) whose weights are taken for the curvature, by quadrature over
    exponential energies e. The windows: squared and half overlapping they weight samples by 1 - sin^2 / 2.
    """
    freedom = REPLAY_FREEDOM
    (scale,) = tail_scale(np.array([freedom]))

    def mean(f):
        return quad(lambda e: np.exp(-e) * f(e), 0.0, np.inf)[0]

    weight = mean(lambda e: (freedom + 1.0) / (scale + e))
    curvature = weight - mean(lambda e: (freedom + 1.0) * e / (scale + e) ** 2)
    tails = mean(lambda e: e * ((freedom + 1.0) / (scale + e)) ** 2) * weight / curvature ** 2
    windows = 1.0 - 0.5 * np.sin(np.linspace(0.0, 2.0 * np.pi, 1000, endpoint=False)) ** 2
    return tails * np.mean(windows ** 2) / np.mean(windows) ** 2


def coverage(ratio, added):
    """Fraction of 90 % intervals that hold the truth, whose variance is 1 + added (n,), and the error's is `ratio`."""
    return np.mean(2.0 * norm.cdf(norm.ppf(0.95) * np.sqrt((1.0 + added) / ratio)) - 1.0)


@pytest.fixture(scope="module")
def hovers():
    """Flights of white noise with a constant force: a linear Gaussian problem, whose parameters are the force."""
    return [Data(FLOOR, [hover(3000 + i, BIAS, length_s=20.0)]) for i in range(REPEATS)]


def test_intervals_of_a_fit_hold_the_truth_of_a_linear_gaussian_problem(hovers):
    """Somewhat fewer than 90 % do: those of the fit alone, without the halves' difference and the model's error."""
    (term,) = terms("imu_bias")[:1]
    held = []
    for data in hovers:
        fitted = fit(data, whole_of(data), [term])
        intervals = term.quantities(fitted.scaled, fitted.covariance)
        held += [intervals[n].low < true < intervals[n].high for n, true in zip(BIAS_NAMES, BIAS, strict=True)]
    expected = coverage(true_over_fitted_variance(), np.zeros(1))
    assert 0.85 < expected < 0.9 and within_scatter(held, expected)


def named_by(data, term):
    """The selection that names one effect, with its fits to both halves."""
    fits = tuple(fit(data, part, [term]) for part in halves(data))
    candidate = Hypothesis(term.name, fits[0].terms, 100.0, fits, evidence=100.0)
    return Selection({term.name: candidate}, (Step.of(candidate),), NamelessGain(), halves(data),
                     {term.name: 8.0}, policy_of(FLOOR, 20.0), spectrum_is_assumed=False)


def test_intervals_of_a_named_effect_hold_the_truth_of_a_linear_gaussian_problem(hovers):
    """Somewhat more than 90 % do: the square of half the halves' difference is added, which scatters as the mean does.

    The bias is so small that the model's error counts for little.
    """
    (term,) = terms("imu_bias")[:1]
    held = []
    for data in hovers:
        (effect,) = named_effects(data, named_by(data, term))
        held += [effect.parameters[n].low < true < effect.parameters[n].high
                 for n, true in zip(BIAS_NAMES, BIAS, strict=True)]
    ratio = true_over_fitted_variance()
    expected = coverage(ratio, ratio * np.random.default_rng(0).normal(size=100_000) ** 2)
    assert 0.9 < expected < 0.95 and within_scatter(held, expected)


def test_variance_is_that_of_the_fit_of_the_halves_and_of_the_model(hovers):
    """On the diagonal half the difference of the halves, and a fifth of a per cent of the parameter, both squared."""
    (term,) = terms("imu_bias")[:1]
    data = hovers[0]
    fitted = fit(data, whole_of(data), [term])
    apart = np.arange(6.0)
    of_halves = [FittedTerms((term.fitted(x),), x, np.zeros((6, 6))) for x in (0.01 * apart, 0.03 * apart)]
    estimate = from_spectra(data, fitted.terms[0], fitted, of_halves)
    np.testing.assert_array_equal(estimate.x, fitted.scaled)
    added = (0.01 * apart) ** 2 + (REPLAY_ERROR * mean_parameters(fitted.terms)) ** 2
    np.testing.assert_allclose(estimate.covariance, fitted.covariance + np.diag(added))
    alone = from_spectra(data, fitted.terms[0], fitted, ())
    np.testing.assert_allclose(alone.covariance,
                               fitted.covariance + np.diag((REPLAY_ERROR * mean_parameters(fitted.terms)) ** 2))


def test_variance_of_a_random_effect_is_that_of_its_strength_and_of_its_assumed_spectrum():
    data = Data(FLOOR, [hover(7, louder=1.5, length_s=10.0)])
    fitted = fit(data, whole_of(data), [terms("imu_noise")[0]])
    (noise,) = fitted.terms
    estimate = from_spectra(data, noise, fitted, ())
    own = strength_variance(data, whole_of(data), fitted.terms, noise)
    np.testing.assert_allclose(estimate.covariance, own + (SPECTRUM_ERROR * estimate.x) ** 2)


@pytest.mark.parametrize(("name", "in_loop", "error"), [
    ("mass", False, REPLAY_ERROR), ("imu_noise", False, SPECTRUM_ERROR), ("inertia", True, LOOP_ERROR)])
def test_error_of_the_model_of_an_effect(name, in_loop, error):
    loop = SimpleNamespace(changes_loop=lambda active: in_loop)
    assert model_error(loop, terms(name)[0]) == error
    if not in_loop:
        assert model_error(None, terms(name)[0]) == error


def test_error_of_a_model_is_its_own_scatter_at_least():
    mass = terms("mass")[0]
    scattered = SimpleNamespace(active=mass.active, shows_in=mass.shows_in, signature=SimpleNamespace(own_scatter=0.3))
    assert model_error(None, scattered) == 0.3


def of_times(name, values, samples):
    """The 90 % interval of the first free parameter of an effect of the logged times, measured in so many samples."""
    (term,) = terms(name)[:1]
    term = replace(term, values={**term.values, **values})
    data = SimpleNamespace(flights=[range(samples)], study=study(0.0))
    return term.quantities(*from_times(data, term))[term.free[0]]


def study(jitter_s):
    """A study whose nominal flights have this jitter."""
    return SimpleNamespace(floor=SimpleNamespace(clock_s=jitter_s))


@pytest.mark.parametrize("true_s", [0.0008, 0.0012, 0.004])
def test_nine_in_ten_intervals_of_a_jitter_hold_the_truth(true_s):
    """Over a nominal jitter of 1 ms: arrival times keep their error for CORRELATION_S, and only their sum is seen."""
    rng, nominal_s, independent, held = np.random.default_rng(1), 0.001, 300, []
    (term,), each = terms("time_jitter")[:1], round(CORRELATION_S / PERIOD_S)
    for _ in range(2000):
        clock_s = rng.normal(0.0, np.hypot(true_s, nominal_s), independent).repeat(each)
        data = SimpleNamespace(flights=[Times(clock_s)], study=study(nominal_s))
        fitted, _ = measured_clock_term(data, term)
        interval = fitted.quantities(*from_times(data, fitted))[fitted.free[0]]
        held.append(interval.low < true_s < interval.high)
    assert np.mean(held) == pytest.approx(0.9, abs=0.03)


class Times:
    """A flight of which nothing is asked but its logged times."""

    def __init__(self, clock_s):
        self.clock_s = clock_s

    def __len__(self):
        return len(self.clock_s)


@pytest.mark.parametrize("burst", [1.0, 2.0, 5.0])
def test_nine_in_ten_intervals_of_a_loss_hold_the_truth(burst):
    """Runs of lost samples that begin as in a Poisson process, of geometric lengths."""
    rng, share, samples, held = np.random.default_rng(2), 0.03, 40_000, []
    for _ in range(2000):
        lost = rng.geometric(1.0 / burst, rng.poisson(share * samples / burst)).sum()
        interval = of_times("packet_loss", {"share": lost / samples, "burst": burst}, samples)
        held.append(interval.low < share < interval.high)
    assert np.mean(held) == pytest.approx(0.9, abs=0.02)


def combined(name, x, covariance, reading):
    """Values and 90 % intervals of an effect's parameters with a reading, from scaled ones."""
    term = next(t for t in terms(name) if len(t.free) == len(x))
    return term.quantities(*with_reading(term, Estimate(np.array(x), np.array(covariance)), reading))


def mass(value, deviation, reading):
    step = terms("mass")[0].step("fraction")
    return combined("mass", [value / step], [[(deviation / step) ** 2]], reading)["fraction"]


def test_a_reading_is_weighted_by_its_precision():
    """Two measurements of one number: the closed form of the weighted mean and its error."""
    both = mass(0.10, 0.01, {"fraction": Reading(0.11, 0.02)})
    assert both.value == pytest.approx((4.0 * 0.10 + 0.11) / 5.0)
    assert both.high - both.low == pytest.approx(2.0 * 1.645 * 0.01 * np.sqrt(0.8), rel=1e-6)


def test_an_interval_is_wider_where_replay_and_reading_disagree():
    both = mass(0.10, 0.01, {"fraction": Reading(0.20, 0.01)})
    assert both.value == pytest.approx(0.15)
    assert both.low < 0.10 < 0.20 < both.high


def test_what_the_replay_knows_as_a_sum_stays_a_sum():
    """Of x + y the replay is sure, of either alone it is not: a reading of x moves y by as much the other way."""
    term = terms("com_offset")[0]
    both = combined("com_offset", [1.0, 1.0], [[1.0, -0.9999], [-0.9999, 1.0]],
                    {"x": Reading(0.5 * term.step("x"), 0.01 * term.step("x"))})
    assert both["x"].value == pytest.approx(0.5 * term.step("x"), rel=0.01)
    assert both["y"].value == pytest.approx(1.5 * term.step("y"), rel=0.01)


def test_a_parameter_without_a_reading_stays():
    assert mass(0.10, 0.01, {}).value == pytest.approx(0.10)
