"""The verdict by each of its rules, and the ranking that agrees with it."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from airtouch.gap.answer.ranking import AT_FLOOR, LEAST_DIFFERENCE, alike_of, ranking_of, verdict_of
from airtouch.gap.evidence.counterevidence import Counterevidence
from airtouch.gap.naming.policy import policy_of
from airtouch.gap.naming.records import Hypothesis, NamelessGain, Selection, Step, UnsteadinessRarity
from airtouch.gap.relations.inference import Inference
from airtouch.gap.result import Quantity, RankedCandidate
from airtouch.gap.signatures.candidates import terms
from hovers import FLOOR

RECORDED, SIMULATED = (SimpleNamespace(study=SimpleNamespace(simulated=simulated)) for simulated in (False, True))
POLICY = policy_of(replace(FLOOR, nominal_count=5), 30.0)
GAINS = {"mass": 200.0, "wind": 40.0, "inertia": 2.0}


def candidate(name, gate=()):
    """A candidate that was not fitted in full, so that the ranking asks for no flights."""
    term = replace(terms(name)[0], gate=gate)
    return Hypothesis(name, (term,), GAINS[name], evidence=GAINS[name], full=False)


def selection(named=("mass",), left=4.0, gate=(), by_relations=False, outside_spectra=0.0):
    """A selection that names effects, beside which a nameless model or disturbance gains so many nats."""
    steps = tuple(Step.of(candidate(n, gate)) for n in named)
    inferred = Inference((), GAINS, Counterevidence(left, 30.0, of_distance=False)) if by_relations else None
    return Selection({n: candidate(n) for n in GAINS}, steps, NamelessGain(150.0, left, outside_spectra), (None, None),
                     dict.fromkeys(GAINS, 8.0), POLICY, spectrum_is_assumed=False, inference=inferred)


def gap(before):
    return SimpleNamespace(closure=SimpleNamespace(before=before, shrink=Quantity(0.8)))


OVER = AT_FLOOR + 0.5


@pytest.mark.parametrize(("of", "before", "verdict"), [
    (selection(), AT_FLOOR, "none"), (selection(left=900.0), AT_FLOOR, "none"),  # no gap
    (selection(by_relations=True), AT_FLOOR, "effect"),  # the relations decide
    (selection(gate=(("a.csv", 1.0, 2.0),)), AT_FLOOR, "effect"),  # a passing effect is outside the gap
    (selection(left=900.0), OVER, "unknown"), (selection((), left=900.0), OVER, "unknown"),
    (selection(left=900.0, by_relations=True), AT_FLOOR, "unknown"),
    (selection(()), OVER, "none"), (selection(), OVER, "effect")])
def test_verdict_is_that_of_the_first_rule_that_holds(of, before, verdict):
    assert verdict_of(RECORDED, of, gap(before)) == verdict


@pytest.mark.parametrize(("nats", "verdict"), [(20.0, "effect"), (0.0, "none")])
def test_late_sensors_act_though_the_gap_is_at_its_floor_where_noise_has_another_echo(monkeypatch, nats, verdict):
    monkeypatch.setattr("airtouch.gap.answer.ranking.sensing_gain", lambda *_: nats)
    assert verdict_of(RECORDED, selection(), gap(AT_FLOOR)) == verdict


@pytest.mark.parametrize(("named", "nats", "verdict"), [
    ((), 12.0, "unknown"), ((), 7.0, "none"), (("mass",), 12.0, "none")])
def test_what_shakes_for_some_seconds_acts_though_the_gap_is_at_its_floor(named, nats, verdict):
    unsteady = replace(selection(named), unsteadiness_rarity=UnsteadinessRarity(nats, 8.0))
    assert verdict_of(RECORDED, unsteady, gap(AT_FLOOR)) == verdict


LIMIT = 20.0  #: nats that may be left beside a mass that gains 200


@pytest.mark.parametrize(("of", "nearer", "verdict"), [
    (selection(), False, "none"),
    (selection(), True, "effect"),  # some cells are calmer than nominal flights, others less calm
    (selection(left=LIMIT + 1.0), True, "unknown"),
    (selection(outside_spectra=LIMIT - 1.0, left=LIMIT - 1.0), False, "none"),
    (selection(outside_spectra=LIMIT + 1.0, left=LIMIT + 1.0), False, "unknown")])  # as odd times
def test_simulated_flights_at_their_floor_have_effects_that_bring_cells_nearer(monkeypatch, of, nearer, verdict):
    monkeypatch.setattr("airtouch.gap.answer.ranking.is_nearer_to_floor", lambda *_: nearer)
    assert verdict_of(SIMULATED, of, gap(AT_FLOOR)) == verdict
    assert verdict_of(RECORDED, of, gap(AT_FLOOR)) == "none"
    assert verdict_of(SIMULATED, of, gap(OVER)) == verdict_of(RECORDED, of, gap(OVER)), "above it they are alike"


@pytest.mark.parametrize(("of", "verdict", "answer"), [
    (selection(), "effect", "mass"), (selection(("wind",)), "effect", "wind"), (selection(()), "none", "none"),
    (selection(left=900.0), "unknown", "unknown"),
    (selection(), "none", "none"),  # a gap at its floor
    (selection(("wind",), by_relations=True), "effect", "wind")])  # of two that act together, the weaker alone
def test_ranking_begins_with_the_answer_and_sums_to_one(of, verdict, answer):
    ranking = ranking_of(RECORDED, of, gap(OVER), verdict, answer)
    assert ranking[0].name == answer and ranking[0].probability == max(r.probability for r in ranking)
    assert sum(r.probability for r in ranking) == pytest.approx(1.0)
    assert {r.name for r in ranking} == {*GAINS, "none", "unknown"}
    probabilities = [r.probability for r in ranking]
    assert probabilities == sorted(probabilities, reverse=True)
    assert [bool(r.why) for r in ranking] == [False] + [True] * (len(ranking) - 1)
    assert ranking[0].shrink.value == (0.8 if verdict == "effect" else 0.0), "of one effect named: that of the answer"
    assert [r.measured for r in ranking] == [verdict == "effect"] + [False] * (len(ranking) - 1)


def test_a_shrink_that_was_not_measured_is_a_number_in_the_json_and_says_so():
    """A shrink of 0 that was measured says nothing more."""
    measured, not_measured = RankedCandidate("mass", 0.1, Quantity(0.0)), RankedCandidate("none", 0.1, Quantity(0.0),
                                                                                          measured=False)
    assert measured.plain()["shrink"] == {"value": 0.0, "unit": "1"}
    assert not_measured.plain()["shrink"] == {"value": 0.0, "unit": "1", "measured": False}


ONE_THING = ("mass", "thrust_coefficient")  #: in any log at hand


def gaining(**gains):
    """Candidates that were fitted in full and gain so many nats."""
    return {n: replace(candidate("wind"), name=n, gain=g, full=True) for n, g in gains.items()}


@pytest.mark.parametrize("named", [("mass",), ("mass", "wind"), ("wind", "mass")])
def test_effects_are_alike_by_what_each_gains_alone(named):
    """Of two that are named the first is weighed by its own gain, not by that of both."""
    near = gaining(gust=200.0 - 0.9 * LEAST_DIFFERENCE, mass=200.0, wind=200.0 - 1.1 * LEAST_DIFFERENCE)
    steps = tuple(replace(s, leave_one_out_gain=near[s.name].gain) for s in selection(named).steps)
    of = replace(selection(named), single_effects=near, steps=steps, least_nats=dict.fromkeys(near, 8.0))
    assert alike_of(of)[0] == ("gust", "mass")
    assert not any("wind" in g for g in alike_of(of))


@pytest.mark.parametrize(("evidence", "alike"), [(8.1, (("gust", "mass"), ONE_THING)), (7.9, (ONE_THING,))])
def test_an_effect_with_too_little_evidence_is_not_as_good_as_the_one_named(evidence, alike):
    """It needs 8 nats: as strong as in nominal flights it explains nothing, though it gains as much."""
    near = gaining(mass=200.0, gust=199.0)
    near["gust"] = replace(near["gust"], evidence=evidence)
    of = selection()
    of = replace(of, single_effects=near, least_nats={"mass": 8.0, "gust": 8.0})
    assert alike_of(of) == alike


def test_names_of_one_thing_are_alike_whatever_they_gain():
    """Of the relations of signals too, whose candidates are not fitted."""
    far = gaining(mass=200.0, thrust_coefficient=2.0)
    assert alike_of(replace(selection(), single_effects=far)) == (("mass", "thrust_coefficient"),)
    assert alike_of(selection(())) == ()


def test_names_of_one_thing_are_alike_beside_a_rival_that_is_as_good():
    """Flapping is named; wind is as good, and rotor drag is one thing with flapping though it gains less."""
    near = gaining(blade_flapping=60.0, wind=58.0, rotor_drag=40.0)
    step = replace(selection().steps[0], name="blade_flapping")
    of = replace(selection(), single_effects=near, steps=(step,), least_nats=dict.fromkeys(near, 8.0))
    assert alike_of(of) == (("blade_flapping", "wind"), ("blade_flapping", "rotor_drag"))
    both = gaining(blade_flapping=60.0, wind=58.0, rotor_drag=59.0)
    assert alike_of(replace(of, single_effects=both)) == (("blade_flapping", "rotor_drag", "wind"),), "said once"
