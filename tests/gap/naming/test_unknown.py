"""What speaks against the effects named, and when that makes the answer `unknown`: each number by its definition."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.evidence.counterevidence import Counterevidence
from airtouch.gap.naming.policy import UnknownLimit, policy_of
from airtouch.gap.naming.records import Hypothesis, NamelessGain, OverPrediction, Selection, Step, UnsteadinessRarity
from airtouch.gap.naming.unknown import (
    against_over_limit,
    counterevidence,
    is_explained,
    over_prediction_ratio,
    unsteadiness_ratio,
)
from airtouch.gap.signatures.candidates import terms
from hovers import FLOOR

LEAST = 20.0  #: nats that may be left beside effects that gain little
LIMIT = UnknownLimit(LEAST, share=0.1, assumed_share=0.2, share_over_none=0.05)
POLICY = replace(policy_of(FLOOR, 30.0), unknown=LIMIT)


def selection(left=0.0, gain=None, over_none=0.0, assumed=False, lost=0.0, by_relations=None):
    """A selection whose effects gain so many nats (None: no effect), beside which the nameless model gains `left`."""
    steps = () if gain is None else (Step.of(Hypothesis("mass", (), gain)),)
    inference = None if by_relations is None else SimpleNamespace(counterevidence=by_relations)
    return Selection({}, steps, NamelessGain(over_none, left), (None, None), {}, POLICY, assumed,
                     OverPrediction(lost, 0), inference)


@pytest.mark.parametrize(("options", "limit"), [
    ({}, LEAST), ({"gain": 100.0}, LEAST), ({"gain": 1000.0}, 100.0), ({"gain": 1000.0, "assumed": True}, 200.0),
    ({"gain": 100.0, "over_none": 5000.0}, 250.0)])
def test_the_nameless_model_may_gain_a_share_of_what_the_last_step_gains(options, limit):
    assert counterevidence(selection(left=7.0, **options)) == (7.0, limit, False)


def test_where_the_relations_decide_their_number_and_limit_count():
    of_relations = Counterevidence(70.0, 30.0, of_distance=True)
    assert counterevidence(selection(left=7.0, gain=1000.0, by_relations=of_relations)) == of_relations


def test_over_prediction_is_held_against_the_least_limit():
    assert over_prediction_ratio(selection(gain=1000.0)) == 0.0
    assert over_prediction_ratio(selection(gain=1000.0, lost=0.5 * LEAST)) == 0.5


@pytest.mark.parametrize(("options", "ratio"), [
    ({"left": 50.0}, 2.5), ({"left": 0.0}, np.log(2.0) / LEAST), ({"left": -200.0}, 0.0),
    ({"left": 50.0, "gain": 1000.0}, 0.5), ({"left": 50.0, "gain": 1000.0, "lost": 30.0}, 1.5)])
def test_the_larger_of_both_ratios_counts_and_none_is_negative(options, ratio):
    """What is left enters as log(1 + e^left), which is log 2 where nothing is."""
    assert against_over_limit(selection(**options)) == pytest.approx(ratio, abs=1e-12)


@pytest.mark.parametrize(("ratio", "explained"), [(0.99, True), (1.0, False), (1.01, False)])
def test_flights_are_explained_below_the_limit(ratio, explained):
    softplus_inverse = np.log(np.expm1(ratio * LEAST))
    assert is_explained(selection(left=softplus_inverse * (1.0 + 1e-15))) == explained
    assert is_explained(selection(gain=1000.0, lost=ratio * LEAST)) == explained


GATE = (("a.csv", 1.0, 2.0),)


@pytest.mark.parametrize(("names", "gate", "counts"), [
    ((), (), True), (("imu_noise",), (), True), (("packet_loss",), (), True), (("imu_noise", "packet_loss"), (), True),
    (("imu_noise",), GATE, False), (("mass",), (), False), (("imu_noise", "mass"), (), False)])
def test_unsteady_flights_speak_against_what_is_equally_strong_all_along(names, gate, counts):
    named = tuple(replace(terms(name)[0], gate=gate) for name in names)
    steps = (Step.of(Hypothesis(names[0], named, 1000.0)),) if names else ()
    unsteady = replace(selection(), steps=steps, unsteadiness_rarity=UnsteadinessRarity(12.0, 8.0))
    assert unsteadiness_ratio(unsteady) == (1.5 if counts else 0.0)
    assert is_explained(unsteady) != counts
    assert is_explained(replace(unsteady, unsteadiness_rarity=UnsteadinessRarity(7.9, 8.0)))
