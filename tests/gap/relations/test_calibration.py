"""What a library is calibrated by: shares of evidence, scatter of distances, strengths that show, pairs."""

from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.relations import calibration
from airtouch.gap.relations.calibration import CalibrationFlight, likeliest_distance_scatter, share_of, two_of
from airtouch.gap.relations.learning import drawings


def test_the_scatter_of_distances_is_found_in_flights_of_which_some_hit_something():
    rng = np.random.default_rng(1)
    evidence = np.exp(rng.uniform(3.0, 10.0, 4000))
    excess = np.hypot(19.0, 0.02 * evidence) * rng.standard_t(calibration.DISTANCE_FREEDOM, 4000)
    excess[:40] += 5000.0
    assert likeliest_distance_scatter(excess, evidence, 19.0) == pytest.approx(0.02, rel=0.1)
    assert likeliest_distance_scatter(np.zeros(0), np.zeros(0), 19.0) == 0.0, "no flight"
    assert likeliest_distance_scatter(19.0 * rng.standard_t(calibration.DISTANCE_FREEDOM, 4000), evidence, 19.0) < 0.002


def test_four_of_five_flights_gain_a_smaller_share_than_the_stored_one():
    """Of an evidence of 100 nats, beyond the 10 that chance may gain."""
    gains = [(10.0 + x, 100.0) for x in (0.0, 1.0, 2.0, 3.0, 4.0)]
    assert share_of(gains[1:]) == pytest.approx(np.quantile([0.0, 0.01, 0.02, 0.03, 0.04], 0.8))
    assert share_of([(9.0, 100.0)] * 5) == 0.0
    assert share_of([]) == 0.0


@pytest.mark.parametrize("limit", [0.03, 0.4])
def test_a_class_is_calibrated_down_to_where_half_of_its_flights_show_it(limit):
    def fitted(strength):
        return SimpleNamespace(shows=strength > limit)

    weakest = calibration.weakest_detected_strength(fitted, 1.0, 3)
    assert weakest <= limit < 2.0 * weakest


def test_flights_that_do_not_end_well_say_nothing_of_the_weakest_strength():
    assert calibration.weakest_detected_strength(lambda _: None, 1.0, 3) == 2.0 ** -calibration.CALIBRATION_HALVINGS


def test_a_pair_is_never_two_names_of_one_thing():
    of = [d for name in ("mass", "thrust_coefficient", "rotor_drag") for d in drawings(name)]
    pairs = {frozenset(two_of(of, np.random.default_rng(i))) for i in range(40)}
    assert pairs == {frozenset((0, 2)), frozenset((1, 2))}


def test_parameters_are_those_that_vary_and_need_enough_flights():
    (drawing,) = drawings("rotor_drag")
    shown = [CalibrationFlight(np.array([float(i)]), np.array([float(i), 0.0]), 50.0, 0.0, None, 0.0)
             for i in range(1, 13)]
    readout = calibration.readout_of(drawing, shown, 12)
    assert readout is not None and readout.parameters == ("horizontal",)
    assert readout.amount.shape == readout.strength.shape == (len(shown), 1)
    assert calibration.readout_of(drawing, shown[1:], 12) is None
