"""Which effects must close a part of the gap of recorded flights to be named, and how much of it."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from airtouch.gap.naming.gap_closure import (
    LEAST_CLOSED,
    STANDS_OUT,
    closes_too_little,
    least_closed,
    named_beside_the_loop,
)
from airtouch.gap.passing.gates import KNOWN_OVERHEAD
from airtouch.gap.signatures.candidates import terms


def named(name, gate=(), key=None):
    """A selection that names one effect."""
    term = replace(terms(name)[0], gate=gate)
    return SimpleNamespace(chosen=SimpleNamespace(terms=(term,)), named=(SimpleNamespace(key=key or name),))


def flights(recorded):
    """Data whose loop model knows that a delay of the motors changes the loop."""
    law = SimpleNamespace(changes_loop=lambda active: any(a.effect.name == "actuator_delay" for a in active))
    return SimpleNamespace(study=SimpleNamespace(recorded=recorded, controller=law))


OVER = STANDS_OUT + 0.1


@pytest.mark.parametrize(("selection", "gap", "least"), [
    (named("actuator_delay"), 1.0, LEAST_CLOSED), (named("mass"), OVER, 0.0), (named("mass"), STANDS_OUT, None),
    (named("wind", gate=((0, 1),)), OVER, LEAST_CLOSED), (named("wind", gate=((0, 1),)), STANDS_OUT, None),
    (named("downwash", gate=((0, 1),), key=KNOWN_OVERHEAD), OVER, None), (named("packet_loss"), OVER, None),
    (SimpleNamespace(chosen=None, named=()), OVER, None)])
def test_recorded_flights_hold_names_against_the_gap(selection, gap, least):
    assert least_closed(flights(recorded=True), selection, gap) == least
    assert least_closed(flights(recorded=False), selection, gap) is None


@pytest.mark.parametrize(("name", "closed", "too_little"), [
    ("actuator_delay", LEAST_CLOSED - 0.01, True), ("actuator_delay", LEAST_CLOSED, False),
    ("mass", 0.04, False), ("mass", 0.0, True), ("mass", -0.8, True)])
def test_an_effect_that_takes_nothing_away_is_no_cause(name, closed, too_little):
    assert closes_too_little(flights(recorded=True), named(name), OVER, closed) == too_little


def test_beside_others_effects_of_the_loop_are_held_against_the_gap():
    wake = replace(terms("downwash")[0], gate=((0, 1),))
    several = [SimpleNamespace(name=n) for n in ("actuator_delay", "downwash", "mass")]
    both = SimpleNamespace(chosen=SimpleNamespace(terms=(terms("actuator_delay")[0], wake, terms("mass")[0])),
                           named=several)
    assert named_beside_the_loop(flights(recorded=True), both) == ["downwash", "mass"]
    assert named_beside_the_loop(flights(recorded=False), both) == []
    alone = named("actuator_delay")
    alone.named[0].name = "actuator_delay"
    assert named_beside_the_loop(flights(recorded=True), alone) == [], "it has a rule of its own"
    no_loop = SimpleNamespace(chosen=SimpleNamespace(terms=(wake, terms("mass")[0])), named=several[1:])
    assert named_beside_the_loop(flights(recorded=True), no_loop) == []
