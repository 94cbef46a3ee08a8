"""Scaled parameters of a hypothesis: 0 is neutral, 1 a natural step."""

import numpy as np
import pytest

from airtouch.gap.signatures.candidates import random_part_of, terms
from airtouch.gap.signatures.term import RANGE_STEP, Term, unit
from airtouch.simulation.effects.effect import Effect, Parameter

#: one parameter with a default off neutral, one whose default is neutral, one that shapes
PARAMETERS = (Parameter("force", "N", 3.0, -4.0, 9.0, 1.0, ""), Parameter("lever", "m", 0.0, -1.0, 3.0, 0.0, ""),
              Parameter("reach", "m", 0.2, 0.0, 1.0, None, ""))
MAGNET = Effect("magnet", "", PARAMETERS)
TERM = Term(MAGNET, "mean", ("force", "lever"), {"force": 1.0, "lever": 0.0, "reach": 0.2})


def test_a_natural_step_is_from_neutral_to_default_or_a_share_of_the_range():
    assert [unit(p) for p in PARAMETERS[:2]] == [2.0, RANGE_STEP * 4.0]


def test_scaled_values_are_steps_from_neutral_within_the_bounds():
    assert TERM.at(np.array([0.5, -2.0])) == {"force": 2.0, "lever": pytest.approx(-0.4), "reach": 0.2}
    assert TERM.at(np.array([1e3, -1e3])) == {"force": 9.0, "lever": -1.0, "reach": 0.2}
    low, high = TERM.bounds()
    assert TERM.at(low) == TERM.at(low - 1.0) and TERM.at(high) == TERM.at(high + 1.0)
    assert TERM.scaled(TERM.at(np.array([0.5, -2.0]))) == pytest.approx([0.5, -2.0])


def test_an_interval_holds_90_percent_and_ends_at_the_bounds():
    quantities = TERM.quantities(np.array([0.0, 0.0]), np.diag([0.25, 1e6]))
    assert quantities["force"].value == 1.0
    assert (quantities["force"].low, quantities["force"].high) == pytest.approx((1.0 - 1.645, 1.0 + 1.645))
    assert (quantities["lever"].low, quantities["lever"].high) == (-1.0, 3.0)


def test_values_of_a_variant_stand_at_their_places_among_all_parameters():
    alone = terms("controller_gain")[2]  # of the second of four gains
    assert alone.among_all(np.array([0.3]), np.inf).tolist() == [np.inf, 0.3, np.inf, np.inf]
    assert random_part_of("downwash").among_all(np.array([0.3])).tolist() == [0.3]


def test_a_battery_is_refined_by_its_charge_and_a_ground_effect_has_shapes():
    assert terms("battery_sag")[0].refined().free == ("strength", "charge", "capacity")
    assert terms("mass")[0].refined() == terms("mass")[0] and terms("mass")[0].shaped() == []
    shapes = [t.values["fade"] for t in terms("ground_effect")[0].shaped()]
    assert len(shapes) == 7 and shapes == sorted(shapes, key=lambda fade: fade or np.inf)  # 0 m: it never fades
    assert random_part_of("ground_effect").shaped() == []
