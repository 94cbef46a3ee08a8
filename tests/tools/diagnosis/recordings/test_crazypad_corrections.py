"""The fit of hover powers to corrections of the estimated velocity, on powers that follow a known law."""

import numpy as np
import pytest

from airtouch.gap.balance import hover_balance
from airtouch.gap.balance.hover_pattern import HoverPattern
from tools.diagnosis.recordings.crazypad.corrections import POWER_NAMES, HoverPowers

FACTOR = np.array(hover_balance.ANSWER)  #: power for one (m/s)^2 of corrections, of each of POWER_NAMES
OWN = {"E8": 1e-5, "E9": 4e-5}  #: (m/s)^2 of corrections that would cause what each drone's power is without any


def flights(drone, condition, count, excess=0.0, seed=0):
    """Rows and patterns of a condition. excess: of the powers, log10."""
    corrections = 10.0 ** np.random.default_rng(seed).uniform(-6.0, -3.0, (count, 2))
    powers = np.log10(FACTOR * (OWN[drone] + corrections)) + excess
    return [({"drone": drone, "condition": condition}, HoverPattern(np.zeros(4), p, np.log10(c)))
            for p, c in zip(powers, corrections, strict=True)]


def hover_powers(cases):
    rows, patterns = zip(*cases, strict=True)
    return HoverPowers(rows, patterns)


def test_the_factor_is_that_of_the_law_for_both_drones_and_for_each():
    powers = hover_powers(flights("E8", "normal_flight", 30) + flights("E9", "normal_flight", 30, seed=1))
    fits = list(powers.fits())
    assert [(name, drones) for name, drones, _ in fits] == [
        (name, drones) for name in POWER_NAMES for drones in (["E8", "E9"], ["E8"], ["E9"])]
    for name, drones, fit in fits:
        assert fit.factor == pytest.approx(np.log10(FACTOR[POWER_NAMES.index(name)]), abs=0.01)
        assert len(fit.before) == 30 * len(drones)
        assert fit.after == pytest.approx(0.0, abs=0.01) and fit.before.std() > 0.1


def test_what_is_left_of_a_family_is_its_excess_over_the_normal_flights_by_condition():
    powers = hover_powers(
        flights("E8", "normal_flight", 20) + flights("E8", "cut_M1_2.0mm", 4, excess=0.5, seed=1)
        + flights("E8", "cut_M2_2.0mm", 2, excess=0.3, seed=2) + flights("E8", "add_weight_W1_near_M3", 3, seed=3))
    assert powers.left_over(["rotor damage"]) == pytest.approx(np.array([[0.5, 0.5], [0.3, 0.3]]), abs=0.1)
    assert powers.left_over(["added weight", "slung load"]) == pytest.approx(np.zeros((1, 2)), abs=0.1)
