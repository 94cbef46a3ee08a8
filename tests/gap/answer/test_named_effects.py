"""The parameters of named effects, by replay and by the relations of signals together."""

import numpy as np
import pytest

from airtouch.gap.answer.named_effects import with_reading
from airtouch.gap.result import Found, Quantity


def mass_of(value, deviation):
    interval = Quantity(value, value - 1.645 * deviation, value + 1.645 * deviation)
    return Found("mass", {"fraction": interval})


def test_a_reading_is_weighted_by_its_precision():
    """Two measurements of one number: the closed form of the weighted mean and its error."""
    both = with_reading(mass_of(0.10, 0.01), {"fraction": (0.11, 0.02)}).parameters["fraction"]
    assert both.value == pytest.approx((4.0 * 0.10 + 0.11) / 5.0)
    assert both.high - both.low == pytest.approx(2.0 * 1.645 * 0.01 * np.sqrt(0.8), rel=1e-6)


def test_an_interval_is_wider_where_replay_and_reading_disagree():
    both = with_reading(mass_of(0.10, 0.01), {"fraction": (0.20, 0.01)}).parameters["fraction"]
    assert both.value == pytest.approx(0.15)
    assert both.low < 0.10 < 0.20 < both.high


def test_a_parameter_without_a_reading_stays():
    own = mass_of(0.10, 0.01)
    assert with_reading(own, {}) == own
