"""Probabilities by their rules: odds of `unknown`, its limit beside an answer, and the candidates' odds."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.answer.probabilities import LEAST_LEAD, MOST_UNKNOWN, probabilities
from airtouch.gap.naming.policy import TEMPERATURE, policy_of
from airtouch.gap.naming.records import Hypothesis, NamelessGain, Selection, Step
from airtouch.gap.signatures.candidates import terms
from hovers import FLOOR

POLICY = policy_of(replace(FLOOR, nominal_count=5), 30.0)
LIMIT = POLICY.unknown.least  #: nats that may be left beside effects that gain less than ten times as many
LEAST = 8.0  #: nats of evidence that a candidate needs to be likelier than none


def selection(gains, named=(), left=4.0):
    """A selection among candidates whose evidence is their gain, beside which the nameless model gains `left`."""
    candidates = {n: Hypothesis(n, (terms(n)[0],), g, evidence=g) for n, g in gains.items()}
    return Selection(candidates, tuple(Step.of(candidates[n]) for n in named), NamelessGain(150.0, left), (None, None),
                     dict.fromkeys(gains, LEAST), POLICY, spectrum_is_assumed=False)


@pytest.mark.parametrize("over_limit", [0.5, 1.0, 3.0])
def test_the_odds_of_unknown_are_the_square_of_what_is_left_over_its_limit(over_limit):
    chance = probabilities(selection({"mass": 2.0, "wind": 1.0}, left=over_limit * LIMIT), "unknown")
    assert chance["unknown"] / (1.0 - chance["unknown"]) == pytest.approx(over_limit ** 2, rel=1e-3)
    assert sum(chance.values()) == pytest.approx(1.0) and set(chance) == {"mass", "wind", "none", "unknown"}


def test_unknown_stays_below_the_effect_that_is_the_answer():
    """Nearly as much is left as may be: without the limit `unknown` had nearly one half, and so had mass."""
    gains = {"mass": 30.0, "wind": 30.0}
    chance = probabilities(selection(gains, ("mass",), left=0.99 * LIMIT), "mass")
    assert chance["unknown"] / chance["mass"] == pytest.approx(MOST_UNKNOWN)
    little_left = probabilities(selection(gains, ("mass",), left=0.3 * LIMIT), "mass")["unknown"]
    assert little_left == pytest.approx(0.09 / 1.09, rel=0.01), "far below the limit its own odds count"


def test_unknown_is_not_limited_where_it_is_the_answer():
    chance = probabilities(selection({"mass": 30.0}, ("mass",), left=2.0 * LIMIT), "unknown")
    assert chance["unknown"] == pytest.approx(0.8)


@pytest.mark.parametrize("named", [(), ("mass",)])
def test_unknown_stays_below_none_where_that_is_the_answer(named):
    """Also where more is left than may be, and where an effect is named: the gap is at its floor."""
    chance = probabilities(selection({"mass": 30.0}, named, left=5.0 * LIMIT), "none")
    assert chance["unknown"] / chance["none"] == pytest.approx(MOST_UNKNOWN)


@pytest.mark.parametrize(("other", "behind"), [(60.0, LEAST_LEAD), (50.0 - 0.5 * LEAST_LEAD, LEAST_LEAD), (40.0, 10.0)])
def test_the_effect_named_first_leads_by_its_gain_and_by_lead_at_least(other, behind):
    chance = probabilities(selection({"wind": other, "mass": 50.0}, ("mass",)), "mass")
    assert chance["mass"] / chance["wind"] == pytest.approx(np.exp(behind / TEMPERATURE))


def test_what_has_the_evidence_that_it_needs_stays_ahead_of_what_has_not():
    """Odds of 1/e beside none, however far behind the first effect; one of n that lacks evidence has 1/n at most.

    Mass gains most by far, of which little counts as evidence.
    """
    of_gains = selection({"mass": 900.0, "wind": LEAST, "gust": LEAST - 1e-9}, ("mass",))
    mass = replace(of_gains.single_effects["mass"], evidence=LEAST + 1.0)
    chance = probabilities(replace(of_gains, single_effects={**of_gains.single_effects, "mass": mass}), "mass")
    assert chance["wind"] / chance["none"] == pytest.approx(np.exp(-1.0))
    assert chance["gust"] / chance["none"] == pytest.approx(1.0 / 3.0)


def test_what_is_missing_counts_in_full():
    """Of three candidates each has the odds e^(evidence - needed) / 3 beside none."""
    chance = probabilities(selection({"mass": 6.0, "wind": 1.0, "gust": -3.0}), "none")
    for name, evidence in (("mass", 6.0), ("wind", 1.0), ("gust", -3.0)):
        assert chance[name] / chance["none"] == pytest.approx(np.exp(evidence - LEAST) / 3.0)


@pytest.mark.parametrize("answer", ["wind", "none", "downwash"])
def test_an_answer_with_less_evidence_is_as_probable_as_the_candidate_with_most(answer):
    """Wind beside a gate, a gap at its floor, an effect that is no candidate alone: mass has most evidence."""
    selected = selection({"mass": 30.0, "wind": 12.0, "gust": 1.0})
    by_evidence, chance = probabilities(selected, "mass"), probabilities(selected, answer)
    assert chance[answer] == chance["mass"] == max(chance.values())
    assert sum(chance.values()) == pytest.approx(1.0)
    for other in {"mass", "wind", "gust", "none"} - {answer}:
        assert chance[other] / chance["mass"] == pytest.approx(by_evidence[other] / by_evidence["mass"])


def test_an_answer_with_most_evidence_changes_no_weight():
    selected = selection({"mass": 30.0, "wind": 12.0}, left=0.1 * LIMIT)
    as_answer, without = (probabilities(selected, answer) for answer in ("mass", "unknown"))
    assert as_answer == without
