"""Features in units of what nominal flights scatter by."""

import numpy as np
import pytest

from airtouch.gap.features import feature
from airtouch.gap.features.feature_space import SQUASHED, Standard, cholesky_factor, directions, standard_of
from airtouch.gap.features.flight_features import declared_features


def test_features_far_out_grow_with_the_logarithm_and_missing_ones_say_nothing():
    standard = Standard(np.zeros(4), np.array([1.0, 1.0, 0.0, 1.0]))
    values = standard(np.array([[2.0, -SQUASHED * np.e, 100.0, np.nan]]))[0]
    assert values == pytest.approx([2.0, -2.0 * SQUASHED, 0.0, 0.0])


def test_a_standard_is_the_median_and_the_middle_two_thirds():
    rng = np.random.default_rng(1)
    features = 3.0 + 2.0 * rng.normal(size=(1000, len(declared_features())))
    features[:50] = 1e6  # flights that hit something
    standard = standard_of(features)
    assert np.median(standard.middle) == pytest.approx(3.0, abs=0.2)
    assert np.median(standard.deviation) == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize(("missing", "deviation"), [(0.4, 2.0), (0.6, 0.0)])
def test_flights_that_lack_a_feature_make_it_no_surer(missing, deviation):
    """Normal features of deviation 2. Missing ones counted as the median: the deviation was over a third too small."""
    rng = np.random.default_rng(2)
    features = 2.0 * rng.normal(size=(2000, len(declared_features())))
    features[rng.random(features.shape) < missing] = np.nan
    assert np.median(standard_of(features).deviation) == pytest.approx(deviation, rel=0.05)


def test_no_feature_is_known_better_than_the_simulator_is():
    """Features that do not vary at all: coherences, logarithms and the clock have a least deviation, others none."""
    names = [f.name for f in declared_features()]
    deviation = dict(zip(names, standard_of(np.ones((50, len(names)))).deviation, strict=True))
    assert deviation["roll real command:turn 0"] == feature.LEAST_COHERENCE
    assert deviation["roll power command 0"] == feature.LEAST_LOG
    assert deviation["clock rms"] == feature.LEAST_CLOCK and deviation["clock lost"] == feature.LEAST_LOST
    assert deviation["later mean force residual x"] == 0.0


def test_every_feature_has_a_name_of_its_own_and_says_no_more_than_the_simulator_is_exact():
    least = {f.name: f.least for f in declared_features()}
    assert len(least) == len(declared_features())
    assert {least[n] for n in least if " variance " in n or " power " in n or " alone " in n} == {feature.LEAST_LOG}
    assert {least[n] for n in least if " real " in n or " imaginary " in n} == {feature.LEAST_COHERENCE}


@pytest.mark.parametrize(("many", "length", "few", "of_few", "first"), [
    (5, 9.0, 3, 1000.0, 1),  # beyond a length of 8 their number counts alone
    (10, 8.2, 9, 20.0, 1),
    (3, 6.0, 2, 8.0, 0)])  # below it the squared length: 3 x 36 are less than 2 x 64
def test_long_shifts_count_no_more_than_those_of_length_eight(many, length, few, of_few, first):
    shifts = np.concatenate([np.tile(of_few * np.eye(4)[0], (few, 1)), np.tile(length * np.eye(4)[1], (many, 1))])
    axes = directions([], 0, shifts, 1)
    assert np.abs(axes[:, 0]) == pytest.approx(np.eye(4)[first])


def test_a_tenth_of_the_covariance_is_variance_that_no_nominal_flight_shows():
    """Two features that always agree: as exact as their difference is no simulated vehicle."""
    draws = np.repeat(np.random.default_rng(1).normal(size=(50, 1)), 2, axis=1)
    lower = cholesky_factor(draws)
    variance = draws[:, 0].var(ddof=1)
    assert lower @ lower.T == pytest.approx(np.array([[0.9 * variance + 0.1, 0.9 * variance],
                                                      [0.9 * variance, 0.9 * variance + 0.1]]))


def test_directions_are_those_that_shifts_have():
    """Shifts along one way have one direction, however many are asked for."""
    axes = directions([5.0 * np.tile(np.eye(4)[2], (6, 1))], 3, 9.0 * np.tile(np.eye(4)[0], (6, 1)), 3)
    assert np.abs(axes) == pytest.approx(np.eye(4)[:, [0, 2]])


def test_directions_hold_the_shifts_of_every_class_whatever_their_length():
    rng = np.random.default_rng(4)
    nameless = 50.0 * rng.normal(size=(100, 1)) * np.eye(8)[0]
    strong, weak = (s * rng.normal(size=(100, 1)) * np.eye(8)[i] for s, i in ((1000.0, 1), (10.0, 2)))
    axes = directions([strong, weak], 1, nameless, 1)
    assert axes.T @ axes == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.norm(axes, axis=1) == pytest.approx([1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0], abs=1e-9)
