"""ApparentStrengths strengths of effects in a simulated flight that has none."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.nominal.apparent import NOBODY_KNOWS, apparent_strengths, evenly_chosen, is_recorded
from airtouch.gap.signatures.candidates import all_candidates, strength_term
from airtouch.gap.signatures.signature import MEAN
from airtouch.simulation import signals as at
from airtouch.simulation.effects import EFFECTS
from gap_flights import fly
from hovers import FLOOR, hover


def test_an_effect_pressed_to_none_says_nothing_of_how_far(study):
    """A strength at its bound of none has no curvature of its own: an error of next to nothing would say that nominal
    flights never differ in it."""
    nominal = apparent_strengths(Data(study, fly(1, 47)))
    pressed = free = 0
    for name, hypotheses in all_candidates(()).items():
        term = strength_term(hypotheses[0])
        if name not in nominal.strengths or term.shows_in != MEAN:
            continue
        low = term.among_all(term.bounds()[0], -np.inf)
        for strength, error, least in zip(nominal.strengths[name], nominal.errors[name], low, strict=True):
            if least == 0.0 and strength < 1e-6:
                pressed += 1
                assert error == NOBODY_KNOWS, name
            elif strength > 1e-3 and least == 0.0:
                free += 1
                assert error > 1e-4, name
    assert pressed >= 2 and free >= 2


@pytest.mark.parametrize(("height", "hidden"), [(1.0, True), (0.06, False)])
def test_a_flight_high_above_the_ground_shows_nothing_of_ground_effect(height, hidden):
    flown = hover(7, length_s=20.0)
    signals = flown.signals.copy()
    for place in (at.LOWER_HEIGHT, at.UPPER_HEIGHT):
        signals[:, place:place + 4] = height + 0.01 * np.sin(np.arange(len(signals)) / 30.0)[:, None]
    others = [name for name in EFFECTS if name != "ground_effect"]
    apparent = apparent_strengths(Data(FLOOR, [replace(flown, signals=signals)]), without=others)
    assert apparent.hidden == ({"ground_effect"} if hidden else set())


def flights(count, meta):
    """Stand-ins that have a log's metadata alone."""
    return [SimpleNamespace(log=SimpleNamespace(meta=meta), name=str(i)) for i in range(count)]


@pytest.mark.parametrize(("count", "chosen"), [
    (0, []), (1, []), (2, [0, 1]), (3, [0, 1, 2]), (5, [0, 1, 2, 4]), (40, [0, 13, 26, 39])])
def test_strengths_are_measured_in_four_flights_evenly_chosen(count, chosen):
    assert [int(f.name) for f in evenly_chosen(flights(count, {}))] == chosen


@pytest.mark.parametrize(("meta", "recorded"), [
    ({"format": "usd-2"}, True), ({"format": "authors-12"}, True), ({"format": "canonical"}, False), ({}, False),
    ({"format": "canonical", "origin_format": "imrclab"}, True), ({"format": "simulated"}, False),
    ({"format": "usdz"}, False)])
def test_a_log_is_recorded_where_only_drones_write_its_format(meta, recorded):
    assert is_recorded(flights(1, meta)[0]) == recorded
