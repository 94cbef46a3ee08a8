"""Which variants may stand beside the effects that are chosen, what their choice costs, and which are fitted."""

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.naming.judging import trial_of
from airtouch.gap.naming.policy import ABOUT_AS_GOOD
from airtouch.gap.naming.records import Hypothesis
from airtouch.gap.naming.screening import screen
from airtouch.gap.naming.screening.screen import addable, screen_random, start_of
from airtouch.gap.signatures.candidates import all_candidates, random_of
from hovers import FLOOR, hover

CANDIDATES = all_candidates()


def held(name, number=0):
    return CANDIDATES[name][number]


def test_choice_cost_counts_variants_of_as_many_terms():
    costs = {(len(v.terms), v.choice_cost) for v in addable("gust", CANDIDATES["gust"], ())}
    assert costs == {(1, np.log(3.0)), (2, np.log(3.0))}, "three lengths, without and with drag"
    assert [v.choice_cost for v in addable("mass", CANDIDATES["mass"], ())] == [0.0]


def test_term_of_the_base_is_not_addable():
    assert addable("mass", CANDIDATES["mass"], held("mass")) == []
    others = addable("weak_motor", CANDIDATES["weak_motor"], held("weak_motor", 2))
    assert [v.terms[0].values["rotor"] for v in others] == [1.0, 2.0, 4.0]
    assert {v.choice_cost for v in others} == {np.log(4.0)}


@pytest.mark.parametrize(("name", "beside", "some"), [
    ("thrust_coefficient", "mass", False), ("mass", "thrust_coefficient", False),
    ("blade_flapping", "rotor_drag", False), ("inertia", "mass", True)])
def test_interchangeable_effect_is_not_addable(name, beside, some):
    assert bool(addable(name, CANDIDATES[name], held(beside))) is some


def test_companion_leaves_its_effect_addable():
    """Gusts with drag beside them leave the rotors' drag a candidate."""
    gust_with_drag = next(v for v in CANDIDATES["gust"] if len(v) == 2)
    assert addable("rotor_drag", CANDIDATES["rotor_drag"], gust_with_drag)


def test_mean_terms_about_as_good_are_fitted_with_the_random_part():
    """Three shapes of a lift: the second is nearly as good as the best, the third is not."""
    start = start_of(trial_of(Data(FLOOR, [hover(7, length_s=10.0)])), None)
    variants = addable("ground_effect", CANDIDATES["ground_effect"], ())
    shapes = [v.terms for v in variants if not random_of(v.terms)][:3]
    gains = (20.0, 20.0 - 0.9 * ABOUT_AS_GOOD, 20.0 - 1.1 * ABOUT_AS_GOOD)
    means = [Hypothesis("ground_effect", terms, gain) for terms, gain in zip(shapes, gains, strict=True)]
    _, fitted = screen_random(start, [v for v in variants if random_of(v.terms)], means, every_random=False)
    shape_of = {i: terms[0].values for i, terms in enumerate(shapes)}
    assert {i for v in fitted for i, values in shape_of.items() if v.terms[0].values == values} == {0, 1}


@pytest.mark.parametrize("swirl", [0.0, 0.01])
def test_of_the_variants_of_a_random_part_the_best_is_fitted(monkeypatch, swirl):
    """Turbulence that turns the vehicle, or that does not, gains more, whatever lift stands beside it."""
    gains = {swirl: 29.0, 0.01 - swirl: 20.0}
    monkeypatch.setattr(screen, "judge_random", lambda _, term: (gains[term.values["swirl"]], np.ones(1)))
    start = start_of(trial_of(Data(FLOOR, [hover(7, length_s=10.0)])), None)
    variants = [v for v in addable("ground_effect", CANDIDATES["ground_effect"], ()) if random_of(v.terms)]
    _, fitted = screen_random(start, variants, [], every_random=False)
    assert [v.terms[1].values["swirl"] for v in fitted] == [swirl] * (len(variants) // 2)
