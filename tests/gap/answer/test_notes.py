"""Notes on the effects named: parameters at the end of their range, signs that do not show."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from airtouch.gap.answer.named_effects import with_random_part
from airtouch.gap.answer.notes import (
    at_end_of_range,
    cannot_be_replayed,
    mostly_random,
    noise_echoed_otherwise,
    signs_not_shown,
)
from airtouch.gap.result import NamedEffect, Quantity
from airtouch.gap.signatures.candidates import random_part_of


def test_a_parameter_at_the_end_of_its_range_has_a_note():
    """Slow motors have a factor of at most 5; a wake's turbulence of 0 is none, and no end."""
    def named(name, **values):
        return NamedEffect(name, {k: Quantity(v) for k, v in values.items()})

    (note,) = at_end_of_range([named("motor_lag", factor=5.0, fall=1.0), named("wind", x=1.0, y=0.0, z=-9.0)])
    assert note.startswith("motor_lag: factor is at the end of its range (5)")
    assert len(at_end_of_range([named("wind", x=10.0, y=0.0, z=-10.0)])) == 2
    assert not at_end_of_range([named("downwash", strength=1.0, turbulence=0.0), named("motor_lag", factor=1.0)])


def test_a_wake_that_shakes_more_than_a_simulator_can_be_given_has_a_note():
    """The strength of a mean too weak for its random part is raised until the turbulence is within its range."""
    def wake(turbulence):
        effect = NamedEffect("downwash", {k: Quantity(v) for k, v in {"strength": 1e-4, "turbulence": 0.0}.items()})
        part = random_part_of("downwash")
        part = replace(part, values={**part.values, "strength": 1.0, "turbulence": turbulence})
        return with_random_part(effect, part)

    (note,) = mostly_random([NamedEffect("mass", {"fraction": Quantity(0.1)}), wake(0.05)])
    assert note.startswith("downwash: it shakes at least 5 times as much as it pushes")
    assert mostly_random([wake(0.0)]) == [] and mostly_random([wake(1e-4)]) == []


@pytest.mark.parametrize(("names", "inference", "words"), [
    (("mass", "range_bias", "flow_latency"), None, "range_bias and flow_latency cannot be seen"),
    (("mass", "range_bias"), None, "range_bias cannot be seen"), (("mass",), None, None),
    (("mass", "range_bias"), SimpleNamespace(), None)])
def test_a_candidate_that_a_replay_does_not_show_is_said_so(names, inference, words):
    selection = SimpleNamespace(single_effects=dict.fromkeys(names), inference=inference, library_holds=False)
    sentences = cannot_be_replayed(selection)
    assert [s[:len(words)] for s in sentences] == [words] if words else sentences == []
    selection.library_holds = True
    assert not any("no library" in sentence for sentence in cannot_be_replayed(selection))


def test_a_sign_that_does_not_show_is_noted_of_named_effects_alone():
    selection = SimpleNamespace(inference=SimpleNamespace(without_sign=("mass", "inertia")),
                                named_steps=(SimpleNamespace(name="mass"),))
    (note,) = signs_not_shown(selection)
    assert note.startswith("mass: ")
    assert signs_not_shown(SimpleNamespace(inference=None)) == []


@pytest.mark.parametrize("nats", [0.0, 17.4])
def test_an_echo_of_noise_that_is_another_one_has_a_note(monkeypatch, nats):
    monkeypatch.setattr("airtouch.gap.answer.notes.changed_echo_nats", lambda _: nats)
    notes = noise_echoed_otherwise("some flights")
    assert len(notes) == bool(nats) and all("(17 nats)" in note for note in notes)
