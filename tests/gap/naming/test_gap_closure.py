"""Which effects must close a part of the gap of recorded flights to be named, and how much of it."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

import airtouch.gap.diagnosis as diagnose
from airtouch.gap.answer.shrink import gap_of
from airtouch.gap.evidence.data import Data
from airtouch.gap.naming.gap_closure import (
    closes_too_little,
    least_shrink,
    named_beside_the_loop,
    with_names_withdrawn,
)
from airtouch.gap.naming.policy import LEAST_CLOSED, STANDS_OUT
from airtouch.gap.naming.select import select
from airtouch.gap.passing.gates import KNOWN_OVERHEAD
from airtouch.gap.result import Closure, Quantity
from airtouch.gap.signatures.candidates import all_candidates, terms
from airtouch.gap.signatures.signature import PASSING
from gap_flights import fly

LAW = SimpleNamespace(changes_loop=lambda active: any(a.effect.name == "actuator_delay" for a in active))
#: its loop model knows that this delay changes the loop
DATA = SimpleNamespace(study=SimpleNamespace(loop=LAW))


def selection(hypothesis, steps, recorded=True):
    """A selection in recorded flights, or in others."""
    policy = SimpleNamespace(must_close_gap=recorded)
    return SimpleNamespace(named_hypothesis=hypothesis, named_steps=steps, policy=policy)


def named(name, gate=(), key=None, recorded=True):
    """A selection that names one effect."""
    term = replace(terms(name)[0], gate=gate)
    return selection(SimpleNamespace(terms=(term,)), (SimpleNamespace(name=name, passing_key=key),), recorded)


OVER = STANDS_OUT + 0.1


@pytest.mark.parametrize(("of", "gap", "least"), [
    (named("actuator_delay"), 1.0, LEAST_CLOSED), (named("mass"), OVER, 0.0), (named("mass"), STANDS_OUT, None),
    (named("wind", gate=((0, 1),)), OVER, LEAST_CLOSED), (named("wind", gate=((0, 1),)), STANDS_OUT, None),
    (named("downwash", gate=((0, 1),), key=KNOWN_OVERHEAD), OVER, None), (named("packet_loss"), OVER, None),
    (selection(None, ()), OVER, None)])
def test_least_share_that_a_named_effect_must_close(of, gap, least):
    assert least_shrink(DATA, of, gap) == least
    assert least_shrink(DATA, selection(of.named_hypothesis, of.named_steps, recorded=False), gap) is None


@pytest.mark.parametrize(("name", "closed", "too_little"), [
    ("actuator_delay", LEAST_CLOSED - 0.01, True), ("actuator_delay", LEAST_CLOSED, False),
    ("mass", 0.04, False), ("mass", 0.0, True), ("mass", -0.8, True)])
def test_effect_that_closes_too_little(name, closed, too_little):
    assert closes_too_little(DATA, named(name), OVER, closed) == too_little


def test_effects_named_beside_one_of_the_loop():
    wake = replace(terms("downwash")[0], gate=((0, 1),))
    several = [SimpleNamespace(name=n) for n in ("actuator_delay", "downwash", "mass")]
    both = SimpleNamespace(terms=(terms("actuator_delay")[0], wake, terms("mass")[0]))
    assert named_beside_the_loop(DATA, selection(both, several)) == ["downwash", "mass"]
    assert named_beside_the_loop(DATA, selection(both, several, recorded=False)) == []
    assert named_beside_the_loop(DATA, named("actuator_delay")) == [], "it has a rule of its own"
    no_loop = SimpleNamespace(terms=(wake, terms("mass")[0]))
    assert named_beside_the_loop(DATA, selection(no_loop, several[1:])) == []


def test_effects_of_the_loop_together_must_close_as_much_as_one():
    """A second delay beside the first let both keep their names though they closed next to nothing."""
    names = ("actuator_delay", "motor_lag")
    law = SimpleNamespace(changes_loop=lambda active: any(a.effect.name in names for a in active))
    data = SimpleNamespace(study=SimpleNamespace(loop=law))
    both = selection(SimpleNamespace(terms=tuple(terms(n)[0] for n in names)),
                     [SimpleNamespace(name=n, passing_key=None) for n in names])
    for gap in (1.0, OVER):
        assert closes_too_little(data, both, gap, LEAST_CLOSED - 0.01)
        assert not closes_too_little(data, both, gap, LEAST_CLOSED)
    assert named_beside_the_loop(data, both) == []


@pytest.fixture(scope="module")
def delayed(study):
    """A study as of recorded flights, a flight with a delay held against it, and what is selected there."""
    recorded = study.with_scatter(replace(study.scatter, exact=False))
    data = Data(recorded, fly(1, 93, {"actuator_delay": {"delay": 0.005}}))
    return recorded, data, select(data, all_candidates())


def test_a_withdrawn_error_of_the_times_is_left_to_the_nameless_model(study):
    """While it is named, the times hold nothing more; without its name they hold all that it gained."""
    data = Data(study, fly(1, 94, {"time_jitter": {"rms": 0.004}}))
    selection = select(data, {"time_jitter": all_candidates()["time_jitter"]}, without=tuple(PASSING))
    assert [s.name for s in selection.named_steps] == ["time_jitter"] and selection.nameless.outside_spectra == 0.0
    after = with_names_withdrawn(data, selection, 0.1)
    assert not after.steps and after.withdrawn == (("time_jitter",), 0.1)
    assert after.nameless.outside_spectra == pytest.approx(selection.steps[0].gain)
    assert after.nameless.over_last_step == after.nameless.over_none == selection.nameless.over_none


@pytest.mark.parametrize("closes", [True, False])
def test_loop_effect_that_closes_too_little_is_not_named(delayed, monkeypatch, closes):
    """It is named with the fraction of the gap that it closes; with less than the loop model's error it is not."""
    recorded, data, selection = delayed
    requests = []
    monkeypatch.setattr(diagnose, "select", lambda *of, **_: requests.append(of[0]) or selection)  # it looks at no gap
    if not closes:
        little = Closure(1.4, 1.36, Quantity(0.1))
        monkeypatch.setattr(diagnose, "gap_of", lambda *of: replace(gap_of(*of), closure=little))
    diagnosis = diagnose.diagnose_with_study(recorded, data.flights, data=data)
    assert requests == [data]
    assert [e.name for e in diagnosis.effects] == (["actuator_delay"] if closes else [])
    assert (diagnosis.verdict == "effect") == closes
