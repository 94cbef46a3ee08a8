"""The parameters of named effects, by replay and by the relations of signals together."""

import numpy as np
import pytest

from airtouch.gap.answer.named_effects import converged, with_reading
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import SETTLED, fit, judge
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.flights.flight import less
from airtouch.gap.result import Found, Quantity
from airtouch.gap.signatures.candidates import terms
from gap_flights import VEHICLE, flown


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


def test_a_fit_goes_on_until_it_stands_still(study):
    """A battery's strength, charge and capacity lie along a bent valley; from its bottom nothing more is gained."""
    true = {"strength": 1.3, "charge": 0.7, "capacity": 1.0}
    data = Data(study, [less(f, VEHICLE, ("vbat_V",)) for f in flown(1, 912, (("battery_sag", true),))])
    whole, term = whole_of(data), terms("battery_sag")[0].refined()
    begun = fit(data, whole, [term], term.scaled({"strength": 0.9, "charge": 0.6, "capacity": 0.6}))
    found = converged(data, whole, begun)
    again = fit(data, whole, found.terms, found.scaled)
    level = judge(data, whole, found.terms)
    assert level > judge(data, whole, begun.terms) + 1.0  # else this flight tests nothing
    assert judge(data, whole, again.terms) < level + SETTLED
    assert level > judge(data, whole, [term.fitted(term.scaled(true))]) - SETTLED
