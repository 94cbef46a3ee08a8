"""Apparent strengths of effects in a simulated flight that has none."""

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.nominal.apparent import NOBODY_KNOWS, apparent
from airtouch.gap.signatures.candidates import all_candidates, strength_term
from airtouch.gap.signatures.signature import MEAN
from gap_flights import fly


def test_an_effect_pressed_to_none_says_nothing_of_how_far(study):
    """A strength at its bound of none has no curvature of its own: an error of next to nothing would say that nominal
    flights never differ in it."""
    nominal = apparent(Data(study, fly(1, 47)))
    pressed = free = 0
    for name, hypotheses in all_candidates(()).items():
        term = strength_term(hypotheses[0])
        if name not in nominal.strengths or term.kind != MEAN:
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
