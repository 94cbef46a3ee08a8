"""The parameters of named effects: by replay and by the relations of signals together, and in the shape flown."""

import numpy as np
import pytest

from airtouch.gap.answer.named_effects import at_end_of_range, best_shape, converged, with_reading
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import SETTLED, fit, judge
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.flights.flight import without_columns
from airtouch.gap.result import NamedEffect, Quantity
from airtouch.gap.signatures.candidates import terms
from gap_flights import VEHICLE, fly


def combined(name, x, covariance, reading):
    """Values and 90 % intervals of an effect's parameters with a reading, from scaled ones."""
    term = next(t for t in terms(name) if len(t.free) == len(x))
    return term.quantities(*with_reading(term, np.array(x), np.array(covariance), reading))


def mass(value, deviation, reading):
    step = terms("mass")[0].step("fraction")
    return combined("mass", [value / step], [[(deviation / step) ** 2]], reading)["fraction"]


def test_a_reading_is_weighted_by_its_precision():
    """Two measurements of one number: the closed form of the weighted mean and its error."""
    both = mass(0.10, 0.01, {"fraction": (0.11, 0.02)})
    assert both.value == pytest.approx((4.0 * 0.10 + 0.11) / 5.0)
    assert both.high - both.low == pytest.approx(2.0 * 1.645 * 0.01 * np.sqrt(0.8), rel=1e-6)


def test_an_interval_is_wider_where_replay_and_reading_disagree():
    both = mass(0.10, 0.01, {"fraction": (0.20, 0.01)})
    assert both.value == pytest.approx(0.15)
    assert both.low < 0.10 < 0.20 < both.high


def test_what_the_replay_knows_as_a_sum_stays_a_sum():
    """Of x + y the replay is sure, of either alone it is not: a reading of x moves y by as much the other way."""
    term = terms("com_offset")[0]
    both = combined("com_offset", [1.0, 1.0], [[1.0, -0.9999], [-0.9999, 1.0]],
                    {"x": (0.5 * term.step("x"), 0.01 * term.step("x"))})
    assert both["x"].value == pytest.approx(0.5 * term.step("x"), rel=0.01)
    assert both["y"].value == pytest.approx(1.5 * term.step("y"), rel=0.01)


def test_a_parameter_without_a_reading_stays():
    assert mass(0.10, 0.01, {}).value == pytest.approx(0.10)


def test_a_parameter_at_the_end_of_its_range_is_told():
    """Slow motors have a factor of at most 5; a wake's turbulence of 0 is none, and no end."""
    def named(name, **values):
        return NamedEffect(name, {k: Quantity(v) for k, v in values.items()})

    (note,) = at_end_of_range([named("motor_lag", factor=5.0, fall=1.0), named("wind", x=1.0, y=0.0, z=-9.0)])
    assert note.startswith("motor_lag: factor is at the end of its range (5)")
    assert len(at_end_of_range([named("wind", x=10.0, y=0.0, z=-10.0)])) == 2
    assert not at_end_of_range([named("downwash", strength=1.0, turbulence=0.0), named("motor_lag", factor=1.0)])


def test_a_fit_goes_on_until_it_stands_still(study):
    """A battery's strength, charge and capacity lie along a bent valley; from its bottom nothing more is gained."""
    true = {"strength": 1.3, "charge": 0.7, "capacity": 1.0}
    data = Data(study, [without_columns(f, VEHICLE, ("vbat_V",)) for f in fly(1, 912, (("battery_sag", true),))])
    blocks, term = whole_of(data), terms("battery_sag")[0].refined()
    start = fit(data, blocks, [term], term.scaled({"strength": 0.9, "charge": 0.6, "capacity": 0.6}))
    result = converged(data, blocks, start)
    refit = fit(data, blocks, result.terms, result.scaled)
    level = judge(data, blocks, result.terms)
    assert level > judge(data, blocks, start.terms) + 1.0  # else this flight tests nothing
    assert judge(data, blocks, refit.terms) < level + SETTLED
    assert level > judge(data, blocks, [term.fitted(term.scaled(true))]) - SETTLED


@pytest.mark.parametrize("fade", [0.0, 0.06])
def test_the_shape_that_was_flown_is_found_from_any_other(study, fade):
    """How fast the lift of the ground dies out with height, from all the data."""
    data = Data(study, fly(2, 77, [("ground_effect", {"strength": 1.5, "fade": fade, "turbulence": 0.0})]))
    for start in terms("ground_effect"):
        values = best_shape(data, whole_of(data), [start], None).terms[0].values
        assert values["fade"] == fade
