"""Why a candidate is not the answer: each reason, by replay and by the relations of the signals."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from airtouch.gap.answer.reasons import nearest, shortfall, why_not
from airtouch.gap.evidence.cells import REST_VIEW, cell_numbers
from airtouch.gap.evidence.counterevidence import Counterevidence
from airtouch.gap.naming.policy import policy_of
from airtouch.gap.naming.records import (
    Hypothesis,
    NamelessGain,
    OutgainedPassing,
    OverPrediction,
    Selection,
    Step,
    UnsteadinessRarity,
    WithdrawnNames,
)
from airtouch.gap.naming.unknown import is_explained
from airtouch.gap.relations.inference import LEAST_EVIDENCE
from airtouch.gap.signals.channels import COLUMN
from hovers import FLOOR

EVIDENCE = {"mass": 200.0, "wind": 40.0, "gust": 20.0, "inertia": 2.0}
POLICY = policy_of(replace(FLOOR, nominal_count=5), 30.0)  #: of flights compared with five nominal ones
TERMS = {name: (SimpleNamespace(name=name, slot=name, shows_in="mean"),) for name in EVIDENCE}


def judged(name, gain, evidence=None):
    return Hypothesis(name, TERMS[name], gain, evidence=gain if evidence is None else evidence)


def selection(named=("mass",), inference=False, of_distance=False, beside=4.0, lost=(0.0, None)):
    """A selection of made candidates: mass gains most, wind is as strong in nominal flights, inertia gains nothing.

    Of several that are named, each adds a quarter of its gain to the others. beside: nats that speak against them.
    """
    single_effects = {n: judged(n, g, 3.0 if n == "wind" else g) for n, g in EVIDENCE.items()}
    steps, total = [], 0.0
    for n in named:
        total += EVIDENCE[n]
        steps.append(replace(Step.of(judged(n, total)), leave_one_out_gain=0.25 * EVIDENCE[n]))
    related = SimpleNamespace(evidence=EVIDENCE,
                              counterevidence=Counterevidence(beside, 30.0, of_distance)) if inference else None
    return Selection(single_effects, tuple(steps), NamelessGain(150.0, beside), (None, None),
                     dict.fromkeys(EVIDENCE, 8.0), POLICY, spectrum_is_assumed=False,
                     over_prediction=OverPrediction(*lost), inference=related)


def test_the_answer_has_no_reason():
    assert why_not(selection(), "mass", "effect") == ""
    assert why_not(selection(), "none", "none") == why_not(selection(), "unknown", "unknown") == ""


def test_at_the_floor_that_is_the_reason_of_a_named_effect():
    assert why_not(selection(), "mass", "none") == "the gap as a whole is at its floor"
    assert why_not(selection(), "inertia", "none") == why_not(selection(), "inertia", "effect")


@pytest.mark.parametrize(("name", "words"), [
    ("inertia", "held-out data gain 2.0 nats by it, but 8 are needed"),
    ("wind", "as strong as it often seems to be in nominal flights: of 40 nats 3.0 are beyond that scatter, but 8 are "
             "needed"),
    ("gust", "gains 20 nats, while mass gains 200"),
    ("none", "mass gains 200 nats over it"),
    ("unknown", "a model without names gains 4 nats beside mass, and up to 20 may be left")])
def test_reason_by_the_replay(name, words):
    assert why_not(selection(), name, "effect") == words


@pytest.mark.parametrize(("name", "words"), [
    ("inertia", f"the relations of the signals gain 2.0 nats by it, but {LEAST_EVIDENCE:.0f} are needed"),
    ("wind", "the relations of the signals gain 40 nats by it, but 200 by mass"),
    ("none", "mass gains 200 nats over it"),
    ("unknown", "a model without names gains 4 nats beside mass, and up to 30 may be left")])
def test_by_the_relations_of_the_signals(name, words):
    assert why_not(selection(inference=True), name, "effect") == words


def test_reason_of_a_distance():
    far = selection(inference=True, of_distance=True, beside=70.0)
    assert why_not(far, "mass", "unknown") == ("the flight lies 70 nats farther from it than nominal flights from "
                                               "none, but only up to 30 may be chance")
    near = selection(inference=True, of_distance=True)
    assert why_not(near, "unknown", "effect") == ("the flight lies 4 nats farther from mass than nominal flights from "
                                                  "none, and up to 30 may be chance")
    nothing = selection((), inference=True, of_distance=True)
    assert why_not(nothing, "unknown", "none") == ("the flight lies 4 nats farther from the model than nominal "
                                                   "flights do, and up to 30 may be chance")


def test_reason_of_a_second_named_effect():
    for named in (("mass", "wind"), ("wind", "mass")):  # in either order of the steps
        pair = selection(named)
        assert why_not(pair, "wind", "effect") == ("named beside mass: adds 10 nats to the others; the probability is "
                                                   "that it acts alone")
    related = selection(("mass", "wind"), inference=True)
    assert why_not(related, "wind", "effect") == "named beside mass: the probability is that it acts alone"


def test_reasons_where_nothing_is_named():
    nothing = selection((), beside=40.0)
    assert not is_explained(nothing)
    assert why_not(nothing, "none", "unknown") == "a model without names gains 40 nats, but only up to 18 may be left"
    assert shortfall(nothing, judged("mass", 90.0)) == "gains 90 nats, while a model without names gains 150"
    back = replace(nothing, withdrawn=WithdrawnNames(("mass",), -0.2))
    counted = "where the cells in which it gains count as well, too little to be its cause"  # the ranking's shrink: not
    assert shortfall(back, judged("mass", 990.0)) == f"closes 0% of the gap {counted}"
    assert shortfall(back, judged("wind", 900.0)) == ("gains 900 nats, but mass explains the flights better, and "
                                                      "closes too little of the gap")
    both = replace(nothing, withdrawn=WithdrawnNames(("mass", "wind"), 0.02))
    for name, other in (("mass", "wind"), ("wind", "mass")):
        assert shortfall(both, judged(name, 990.0)) == f"closes 2% of the gap together with {other} {counted}"
    related = selection((), inference=True, beside=40.0)
    assert why_not(related, "wind", "unknown") == ("the relations of the signals gain 40.0 nats by it, and more by a "
                                                   "model without names")
    assert why_not(related, "unknown", "none") == "the gap as a whole is at its floor"


def test_reason_of_a_passing_effect_that_a_steady_one_outgains():
    """It is that of the effect in its seconds, not of the same effect all along, which nominal flights have as well."""
    passing = replace(selection(), outgained={"wind": OutgainedPassing(205.0, "mass", 200.0)})
    assert why_not(passing, "wind", "effect") == ("in some seconds alone it gains 205 nats, but mass all along 200, "
                                                  "and 12 more than that are needed")
    assert why_not(replace(passing, outgained={"gust": OutgainedPassing(205.0, "mass", 200.0)}), "gust",
                   "effect") == "gains 20 nats, while mass gains 200"  # all along it has evidence


def test_reason_where_the_flight_is_less_steady_than_nominal_ones():
    unsteady = replace(selection(()), unsteadiness_rarity=UnsteadinessRarity(12.34, 8.0))
    assert not is_explained(unsteady)
    assert why_not(unsteady, "none", "unknown") == ("torque and lift are less steady than in nominal flights by 12.3 "
                                                    "nats, but only up to 8.0 may be chance")
    steady = replace(unsteady, unsteadiness_rarity=UnsteadinessRarity(7.0, 8.0))
    assert why_not(steady, "unknown", "none") == ("torque and lift are less steady than in nominal flights by 7.0 "
                                                  "nats, and up to 8.0 may be chance")
    left_too = replace(unsteady, nameless=NamelessGain(150.0, 40.0))
    assert why_not(left_too, "none", "unknown").startswith("a model without names gains 40 nats")


def test_reason_of_the_best_effect_where_the_answer_is_unknown():
    """The best effect where the answer is `unknown`: by what is left beside it, or by what it says and is not there."""
    open_gap = selection(beside=70.0)
    assert why_not(open_gap, "mass", "unknown") == ("a model without names gains 70 nats beside it, but "
                                                     "only up to 20 may be left")
    over_predicting = selection(lost=(60.0, cell_numbers(REST_VIEW, 1, COLUMN["torque_z"])))
    assert why_not(over_predicting, "mass", "unknown") == (
        "it loses 60 nats where it says more than the flights show, most in yaw torque at 0.6-2 Hz at rest, "
        "but only up to 18 may be chance")


def test_the_three_that_gain_most_are_nearest():
    assert [n.name for n in nearest(selection(()))] == ["mass", "wind", "gust"]
    assert all(n.why for n in nearest(selection(())))
