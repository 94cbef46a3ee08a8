"""A selection's effects named, told from deviations of the same name."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.evidence.fit import FittedTerms
from airtouch.gap.naming.records import Hypothesis, NamelessGain, Selection, Step
from airtouch.gap.signatures.candidates import all_candidates, terms
from airtouch.gap.signatures.signature import SPECTRUM


def hypothesis(name, *parts):
    """A candidate fitted to both halves with these terms."""
    return Hypothesis(name, parts, 100.0, tuple(FittedTerms(parts, np.zeros(0), np.zeros((0, 0))) for _ in (0, 1)))


def selection(*steps):
    return Selection({}, steps, NamelessGain(), (), {}, SimpleNamespace(), False)


def rotor(number):
    return next(t for t in terms("weak_motor") if t.values["rotor"] == number)


@pytest.mark.parametrize("named", [(True, False), (False, True), (True, True)])
def test_one_rotor_may_be_named_and_another_a_deviation(named):
    one, three = rotor(1), rotor(3)
    both = selection(Step.of(hypothesis("weak_motor", one), named[0]),
                     Step.of(hypothesis("weak_motor", one, three), named[1]))
    expected = [t for t, its in zip((one, three), named, strict=True) if its]
    assert list(both.named_hypothesis.terms) == expected
    assert [list(f.terms) for f in both.named_hypothesis.fits] == [expected, expected]


def test_the_companion_of_a_named_effect_is_told_from_a_deviation_of_its_name():
    drag, wind = terms("rotor_drag")[0], terms("wind")[0]
    companion = replace(drag, companion=True)
    both = selection(Step.of(hypothesis("rotor_drag", drag), is_named=False),
                     Step.of(hypothesis("wind", drag, wind, companion)))
    assert list(both.named_hypothesis.terms) == [wind, companion]


def test_a_random_part_belongs_to_the_effect_named():
    mean, part = next(v for v in all_candidates()["downwash"] if len(v) == 2 and v[1].shows_in == SPECTRUM)
    named = selection(Step.of(hypothesis("downwash", mean, part)))
    assert list(named.named_hypothesis.terms) == [mean, part]


def test_nothing_is_chosen_where_only_deviations_stand():
    assert selection(Step.of(hypothesis("weak_motor", rotor(1)), is_named=False)).named_hypothesis is None
    assert selection().named_hypothesis is None
