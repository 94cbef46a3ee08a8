"""Sentences and rows on a twin and its flights say what the figures say."""

import pytest

from airtouch.twin.comparison.compare import Gap
from airtouch.twin.comparison.two_sample import Auroc
from airtouch.twin.comparison.words import answer, gap_row
from airtouch.twin.recorded.features import Feature


def auroc(phase, value):
    return Auroc(phase, value, value - 0.1, value + 0.1, 5, 5, 100, ())


@pytest.mark.parametrize(("values", "present", "absent"), [
    ({"cruise": 0.52, "edges": 0.59}, ("hardly", "0.59", "edges"), ("0.52",)),
    ({"cruise": 0.52, "edges": 0.61}, ("0.520 (cruise)", "0.610 (edges)"), ("hardly",)),
    ({"cruise": 0.999, "edges": 0.7}, ("0.700 (edges)", "0.999 (cruise)"), ("hardly",)),
    ({"cruise": float("nan"), "edges": 0.59}, ("hardly", "0.59", "edges"), ("nan", "cruise")),
    ({"edges": float("nan")}, ("Too few flights",), ("AUROC", "nan")),
    ({"cruise": 0.52, "edges": 0.05}, ("0.520 (cruise)", "0.050 (edges)"), ("hardly",)),
    ({"cruise": 0.52, "edges": 0.43}, ("hardly", "0.43 at least (edges)"), ("0.52",)),
    ({}, ("Too few flights",), ("AUROC",)),
])
def test_the_sentence_names_the_phase_that_is_told_best(values, present, absent):
    sentence = answer([auroc(*item) for item in values.items()])
    assert all(word in sentence for word in present) and not any(word in sentence for word in absent)


@pytest.mark.parametrize(("unit", "difference", "text"), [
    ("PWM", 1234.4, "+1234 PWM"), ("PWM/s", -7.6, "-8 PWM/s"), ("1", 0.126, "+0.13"), ("m/s^2", -0.004, "-0.00 m/s^2")])
def test_a_row_has_sign_digits_and_unit_of_its_feature(unit, difference, text):
    row = gap_row(Gap(Feature("hover", "trim", unit, 0.1), difference, -2.34, 7))
    assert row == ("trim", "hover", text, "-2.3", 7)
