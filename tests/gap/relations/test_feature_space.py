"""Features in units of what nominal flights scatter by."""

import numpy as np
import pytest

from airtouch.gap.relations import feature_space
from airtouch.gap.relations.feature_space import SQUASHED, Standard, standard_of
from airtouch.gap.relations.features import names


def test_features_far_out_grow_with_the_logarithm_and_missing_ones_say_nothing():
    standard = Standard(np.zeros(4), np.array([1.0, 1.0, 0.0, 1.0]))
    values = standard(np.array([[2.0, -SQUASHED * np.e, 100.0, np.nan]]))[0]
    assert values == pytest.approx([2.0, -2.0 * SQUASHED, 0.0, 0.0])


def test_a_standard_is_the_median_and_the_middle_two_thirds():
    rng = np.random.default_rng(1)
    features = 3.0 + 2.0 * rng.normal(size=(1000, len(names())))
    features[:50] = 1e6  # flights that hit something
    standard = standard_of(features)
    assert np.median(standard.middle) == pytest.approx(3.0, abs=0.2)
    assert np.median(standard.deviation) == pytest.approx(2.0, rel=0.1)


def test_no_feature_is_known_better_than_the_simulator_is():
    """Features that do not vary at all: coherences, logarithms and the clock have a least deviation, others none."""
    deviation = dict(zip(names(), standard_of(np.ones((50, len(names())))).deviation, strict=True))
    assert deviation["roll real command:turn 0"] == feature_space.LEAST_COHERENCE
    assert deviation["roll power command 0"] == feature_space.LEAST_LOG
    assert deviation["clock rms"] == feature_space.LEAST_CLOCK and deviation["clock lost"] == feature_space.LEAST_LOST
    assert deviation["later 0"] == 0.0
