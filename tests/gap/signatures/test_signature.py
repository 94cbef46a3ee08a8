"""The record of each effect against the registry, and its figures against their closed form."""

import numpy as np
import pytest

from airtouch.gap.relations.library import shipped
from airtouch.gap.signatures.signature import (
    CLOCK,
    MEAN,
    RELATIONS_ONLY,
    SIGNATURES,
    SPECTRUM,
    free_of,
    signature_of,
)
from airtouch.simulation.effects import EFFECTS, NAMES
from airtouch.simulation.effects.effect import Effect, Parameter


@pytest.mark.parametrize("name", SIGNATURES)
def test_a_record_names_parameters_of_its_effect_with_values_in_their_bounds(name):
    signature, effect = SIGNATURES[name], EFFECTS[name]
    parameters = {p.name: p for p in effect.parameters}
    assert name in NAMES and signature.shows_in in (MEAN, SPECTRUM, CLOCK)
    assert {*signature.free, *signature.free_later} <= parameters.keys() and signature.free
    values = [*(item for variant in signature.variants for item in variant.items()),
              *(signature.without_random or {}).items()]
    values += [(signature.shape.parameter, v) for v in signature.shape.values] if signature.shape else []
    assert all(parameters[p].low <= value <= parameters[p].high for p, value in values)
    named = (*(signature.loss_runs or ()), signature.several_by, signature.class_by)
    assert all(p in parameters for p in named if p)
    assert bool(signature.spectrum) <= (signature.shows_in == SPECTRUM)
    assert not signature.factors or all(parameters[p].neutral == 1.0 for p in signature.free)
    assert signature.companion == "" or signature.companion in EFFECTS


def test_every_effect_of_the_package_has_a_record_or_is_said_to_be_shown_by_relations_alone():
    assert {*SIGNATURES, *RELATIONS_ONLY} == set(NAMES) and not SIGNATURES.keys() & set(RELATIONS_ONLY)
    library = shipped()
    assert library is not None and library.effects.issuperset(RELATIONS_ONLY)


def test_only_an_effect_with_a_random_part_is_never_tried_without_it():
    assert all(s.without_random is not None for s in SIGNATURES.values() if s.always_random)


def test_an_effect_without_a_record_has_all_parameters_free_that_can_be_neutral():
    effect = Effect("magnet", "", (Parameter("force", "N", 0.02, 0.0, 1.0, 0.0, ""),
                                   Parameter("reach", "m", 0.2, 0.0, 1.0, None, "")))
    assert free_of(effect) == ("force",)
    assert signature_of(effect).shows_in == MEAN


def test_lines_of_four_rotors_scatter_as_their_phases_do():
    phases = np.random.default_rng(3).uniform(0.0, 2.0 * np.pi, (50_000, 4))
    amplitude = np.abs(np.exp(1j * phases).sum(axis=1))
    assert SIGNATURES["vibration"].own_scatter == pytest.approx(amplitude.std() / amplitude.mean(), rel=0.1)
