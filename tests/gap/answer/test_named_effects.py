"""The effects named: in the shape that was flown, with their random parts."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.answer.named_effects import median_index, median_shape_fit, with_random_part
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.result import NamedEffect, Quantity
from airtouch.gap.signatures.candidates import random_part_of, terms
from airtouch.simulation.effects import EFFECTS
from gap_flights import fly


def unsteady(strength, part_strength, turbulence):
    """A ground effect of a strength (0.1 either way), with a random part that was fitted at a strength of its own."""
    effect = NamedEffect("ground_effect", {"strength": Quantity(strength, strength - 0.1, strength + 0.1),
                                           "turbulence": Quantity(0.0), "fade": Quantity(0.06),
                                           "swirl": Quantity(0.0, unit="m")})
    term = random_part_of("ground_effect")
    term = replace(term, values={**term.values, "strength": part_strength, "turbulence": turbulence, "swirl": 0.01})
    return with_random_part(effect, term).parameters


@pytest.mark.parametrize(("strength", "part_strength"), [(2.0, 1.0), (0.5, 1.0), (0.8, 2.0)])
def test_random_force_of_mean_and_part_together_is_that_of_the_part(strength, part_strength):
    """The force of the part is its strength times its turbulence."""
    both = unsteady(strength, part_strength, 0.2)
    assert both["strength"] == Quantity(strength, strength - 0.1, strength + 0.1) and both["fade"].value == 0.06
    assert both["swirl"] == Quantity(0.01, unit="m"), "the variant of the random part is named with it"
    assert both["strength"].value * both["turbulence"].value == pytest.approx(part_strength * 0.2)


@pytest.mark.parametrize("strength", [0.0, 0.01])
def test_a_mean_too_weak_for_its_random_part_is_raised_to_the_least_that_carries_it(strength):
    most = next(p.high for p in EFFECTS["ground_effect"].parameters if p.name == "turbulence")
    both = unsteady(strength, 1.0, 0.5 * most)
    assert both["turbulence"].value == pytest.approx(most)
    assert both["strength"].value == pytest.approx(0.5) and both["strength"].high >= 0.5


def test_a_part_without_power_divides_nothing_by_zero():
    both = unsteady(0.0, 1.0, 0.0)
    assert both["turbulence"].value == 0.0 and 0.0 < both["strength"].value < 1e-3


def test_a_random_part_of_another_effect_changes_nothing():
    effect = NamedEffect("mass", {"fraction": Quantity(0.1)})
    assert with_random_part(effect, random_part_of("ground_effect")) is effect


def test_the_median_of_shapes_is_that_of_the_posterior():
    """By hand: that of the weights at which their sum passes half."""
    assert median_index([3.0, 3.0, 3.0]) == 1
    assert median_index(np.log([1.0, 2.0, 4.0, 8.0])) == 3
    assert median_index([-900.0, 50.0, -900.0]) == 1
    assert median_index(np.log([1.0, 1.0, 1.0, 1.0, 2.1])) == 3  # 4 of 6.1


@pytest.mark.parametrize("fade", [0.0, 0.06])
def test_the_shape_that_was_flown_is_found_from_any_other(study, fade):
    """How fast the lift of the ground dies out with height, from all the data."""
    data = Data(study, fly(2, 77, [("ground_effect", {"strength": 1.5, "fade": fade, "turbulence": 0.0})]))
    for start in terms("ground_effect"):
        values = median_shape_fit(data, whole_of(data), [start], None).terms[0].values
        assert values["fade"] == fade
