"""How effects are drawn where flights with them are simulated."""

import numpy as np
import pytest

from airtouch.gap.signatures.random_draws import KINDS, STEPS, kinds_of, log_uniform
from airtouch.gap.signatures.signature import SIGNATURES, free_of
from airtouch.gap.signatures.term import neutral_of, unit
from airtouch.simulation.effects import EFFECTS, get
from airtouch.simulation.effects.effect import Effect, Parameter


def distance(kind, strength, seed):
    """Length of the free parameters' distance from neutral, in natural steps."""
    effect = get(kind.effect)
    values = kind.active(strength, np.random.default_rng(seed)).values
    return np.linalg.norm([(values[p.name] - neutral_of(p)) / unit(p) for p in effect.parameters
                           if p.name in free_of(effect)])


@pytest.mark.parametrize("name", KINDS)
def test_a_stronger_effect_is_farther_from_neutral_and_within_its_bounds(name):
    kind = KINDS[name]
    for seed in range(5):
        sizes = [distance(kind, share * kind.highest, seed) for share in (0.01, 0.1, 1.0)]
        assert 0.0 < sizes[0] < sizes[1] < sizes[2]


def test_what_gives_an_effect_several_classes_is_a_parameter_that_does_not_scale_it():
    by = {name: s.class_by for name, s in SIGNATURES.items() if s.class_by}
    assert by and all(by[n] not in free_of(get(n)) and by[n] in get(n).values() for n in by)


def test_an_effect_is_drawn_in_each_of_the_classes_that_the_diagnosis_tries():
    signature, rng = SIGNATURES["weak_motor"], np.random.default_rng(2)
    drawn = {KINDS["weak_motor"].make(0.1, rng)["rotor"] for _ in range(60)}
    assert drawn == set(signature.class_values) == {1.0, 2.0, 3.0, 4.0}


def test_a_logarithm_is_as_likely_anywhere():
    rng = np.random.default_rng(1)
    drawn = np.log10([log_uniform(0.01, 10.0, rng) for _ in range(4000)])
    assert np.histogram(drawn, bins=3, range=(-2.0, 1.0))[0] == pytest.approx(np.full(3, 4000 / 3), rel=0.1)


def test_an_effect_of_ones_own_is_drawn_in_any_direction_that_its_bounds_allow():
    parameters = (Parameter("up", "N", 0.5, 0.0, 9.0, 0.0, ""), Parameter("down", "N", -0.5, -9.0, 0.0, 0.0, ""),
                  Parameter("either", "N", 0.5, -9.0, 9.0, 0.0, ""), Parameter("shape", "m", 2.0, 0.0, 9.0, None, ""))
    effect = Effect("made_up_magnet", "", parameters)
    (kind,) = kinds_of(effect).values()
    assert kind.highest == STEPS and "made_up_magnet" not in EFFECTS
    values = [kind.make(2.0, np.random.default_rng(i)) for i in range(200)]
    table = np.array([[v["up"], v["down"], v["either"]] for v in values])
    assert np.linalg.norm(table, axis=1) == pytest.approx(np.full(200, 2.0 * 0.5))
    assert np.all(table[:, 0] >= 0.0) and np.all(table[:, 1] <= 0.0)
    assert 0.3 < np.mean(table[:, 2] > 0.0) < 0.7
    assert "shape" not in values[0]


def test_an_effect_without_a_free_parameter_is_drawn_as_it_is():
    (kind,) = kinds_of(Effect("lamp", "", (Parameter("shape", "m", 2.0, 0.0, 9.0, None, ""),))).values()
    assert kind.make(2.0, np.random.default_rng(0)) == {}
