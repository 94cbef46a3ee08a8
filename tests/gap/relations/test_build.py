"""What a library is learned by, on draws of a known covariance."""

import numpy as np
import pytest

from airtouch.gap.features.feature_space import Standard
from airtouch.gap.relations.build import CLEAR_NAMELESS, PairedFlights, Whitening, _beyond_noise, _scatter_of_nameless
from airtouch.gap.relations.learning import drawings


def test_whitened_flights_have_covariance_one():
    rng = np.random.default_rng(1)
    mix = np.eye(4) + 0.5 * rng.normal(size=(4, 4))
    features = 3.0 + 0.1 * rng.normal(size=(20_000, 4)) @ mix.T
    whitening = Whitening(Standard(np.full(4, 3.0), np.full(4, 0.1)), np.linalg.cholesky(mix @ mix.T))
    assert np.cov(whitening(features).T) == pytest.approx(np.eye(4), abs=0.05)
    assert whitening(features[0]) == pytest.approx(whitening(features)[:1])


def test_two_effects_interact_in_the_direction_that_stands_over_noise():
    rng = np.random.default_rng(2)
    noise = 0.05 * rng.normal(size=(300, 40))
    assert _beyond_noise(noise, 0.05 ** 2).shape == (40, 0)
    direction = np.eye(40)[3]
    factors = _beyond_noise(noise + 0.3 * rng.normal(size=(300, 1)) * direction, 0.05 ** 2)
    assert factors.shape == (40, 1)
    assert abs(factors[3, 0]) == pytest.approx(0.3, rel=0.1)


def test_nameless_disturbances_scatter_by_their_directions_not_their_lengths():
    rng = np.random.default_rng(3)
    length = np.exp(rng.uniform(2.0, 8.0, (500, 1)))
    shift = length * np.where(rng.random((500, 1)) < 0.8, np.eye(5)[0], np.eye(5)[1])
    weak = 0.9 * CLEAR_NAMELESS * np.tile(np.eye(5)[4], (500, 1))
    factors = _scatter_of_nameless(np.concatenate([shift, weak]))
    assert np.diag(factors @ factors.T) == pytest.approx([0.8, 0.2, 0.0, 0.0, 0.0], abs=0.05)


def test_effects_of_a_pair_are_of_the_upper_half_of_their_strengths():
    (drawing,) = drawings("mass")
    none = np.zeros((0, 1))
    paired = PairedFlights(drawing, none, none, none, (0.001, 0.1))
    strengths = [paired.draw_strong(np.random.default_rng(i)).values["fraction"] for i in range(200)]
    assert 0.01 <= min(strengths) < 0.011 and 0.09 < max(strengths) <= 0.1
