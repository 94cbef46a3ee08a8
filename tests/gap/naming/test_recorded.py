"""Which effects must close a part of the gap of recorded flights to be named, and how much of it."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from airtouch.gap.naming.recorded import (
    LEAST_CLOSED,
    STANDS_OUT,
    closes_too_little,
    must_close_the_gap,
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


@pytest.mark.parametrize(("selection", "must"), [
    (named("actuator_delay"), True), (named("mass"), False), (named("wind", gate=((0, 1),)), True),
    (named("downwash", gate=((0, 1),), key=KNOWN_OVERHEAD), False), (SimpleNamespace(chosen=None, named=()), False)])
def test_recorded_flights_hold_effects_of_the_loop_and_passing_ones_against_the_gap(selection, must):
    assert must_close_the_gap(flights(recorded=True), selection) == must
    assert not must_close_the_gap(flights(recorded=False), selection)


def test_what_passes_must_close_a_gap_only_where_one_stands_out():
    passing, loop, data = named("wind", gate=((0, 1),)), named("actuator_delay"), flights(recorded=True)
    little, enough = LEAST_CLOSED - 0.01, LEAST_CLOSED
    assert closes_too_little(data, passing, STANDS_OUT + 0.1, little)
    assert not closes_too_little(data, passing, STANDS_OUT, little)
    assert closes_too_little(data, loop, 1.0, little)
    assert not closes_too_little(data, loop, 2.0, enough)


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
