"""The model without names: against closed forms, nominal flights of other seeds, and effects that nobody named."""


import numpy as np
import pytest

from airtouch.gap.diagnosis import diagnose_with_study
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import fit
from airtouch.gap.evidence.judge import judge
from airtouch.gap.nameless import model
from airtouch.gap.nameless.basis import BASIS
from airtouch.gap.nameless.columns import WIDEST
from airtouch.gap.nameless.regression import BlockResiduals, coefficients
from airtouch.gap.naming.judging import halves
from airtouch.gap.signatures import candidates
from airtouch.simulation import effects
from airtouch.simulation import signals as at
from airtouch.simulation.effects import Effect, Parameter, wrench
from gap_flights import LOOP, VEHICLE, fly

PUSH = 0.01  #: N s/m


@wrench
def _sideways(p, s, memory, stream, out):
    out[1] += p[0] * s[at.VELOCITY]


@pytest.fixture
def sideways():
    """A made-up effect: forward speed pushes to the left."""
    effect = effects.register(Effect("sideways", "forward speed pushes to the left",
                                     (Parameter("push", "N s/m", PUSH, 0.0, 1.0, 0.0, "per forward speed"),),
                                     wrench=_sideways))
    yield effect
    effects.unregister("sideways")


def gain_of(study, flights):
    data = Data(study, flights)
    return sum(model.held_out_gains(data, halves(data), [(), ()]))


def test_nominal_flights_of_other_seeds_have_nothing_left(study):
    assert max(gain_of(study, [f]) for f in fly(6, 57)) < 10.0


def test_an_effect_without_a_name_is_measured_and_called_unknown(study, sideways):
    """Its coefficient is force per mass; with the effect in the registry it is named instead."""
    flights = fly(1, 45, {"sideways": {"push": PUSH}})
    data = Data(study, flights)
    push_per_speed = [coefficients(BlockResiduals(data, p, ()), 1, study.nameless_floor)[BASIS.index("vx")]
                      for p in halves(data)]
    np.testing.assert_allclose(push_per_speed, PUSH / VEHICLE.mass_kg, rtol=0.35)
    assert gain_of(study, flights) > 30.0
    with_it, nameless = (diagnose_with_study(study, flights, without, data) for without in (LOOP, (*LOOP, "sideways")))
    chance, without_name = ({r.name: r.probability for r in d.ranking}["unknown"] for d in (with_it, nameless))
    assert nameless.verdict == "unknown" and without_name > 0.85
    assert with_it.verdict == "effect" and with_it.effects[0].name == "sideways" and chance < 0.1


def test_an_effect_with_its_name_beats_the_model_without(study):
    data = Data(study, fly(1, 47, {"com_offset": {"x": 0.001, "y": 0.0}}))
    parts = halves(data)
    (term,) = candidates.terms("com_offset")
    fits = [fit(data, p, (term,)) for p in parts]
    effect_gain = sum(judge(data, parts[1 - k], f.terms) - judge(data, parts[1 - k], ())
                      for k, f in enumerate(fits))
    before = sum(model.held_out_gains(data, parts, [(), ()]))
    after = sum(model.held_out_gains(data, parts, [f.terms for f in fits]))
    assert 30.0 < before < effect_gain and after < 0.15 * effect_gain


def beside(study, term, values, seed):
    """What columns gain beside an effect, without and with those that the effect itself makes."""
    data = Data(study, fly(1, seed, {term.name: values}))
    parts = halves(data)
    fits = [fit(data, p, [term]).terms for p in parts]
    gain = model.held_out_gains(data, parts, fits)[0]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(model, "allowed_columns", lambda *_: np.ones(WIDEST, bool))
        return gain, model.held_out_gains(data, parts, fits)[0]


def test_what_answers_a_random_torque_is_not_new_beside_it(study):
    """Torque of the motors' own noise is in the commands that fight it, so that what is left follows them."""
    term = next(t for t in candidates.terms("motor_noise") if t.values["time"] == 0.02)
    with_answer, without_answer = beside(study, term, {"rms": 0.02}, 51)
    assert with_answer < 5.0 and without_answer > 20.0
