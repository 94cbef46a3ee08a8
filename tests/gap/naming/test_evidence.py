"""The evidence for an effect: its gain over the base, and no more than nominal flights and its bound leave it."""

import numpy as np
import pytest

from airtouch.gap.naming.evidence import with_evidence
from airtouch.gap.naming.records import Candidate, Strength
from airtouch.gap.signatures.candidates import terms
from airtouch.gap.signatures.scatter import Scatter

FREEDOM, RMS = 8.0, 0.5
NOMINAL = Scatter({"mass": np.array([RMS])}, FREEDOM, (0.0, 0.0))


def evidence(scatter, strength, gain=100.0):
    """Evidence for a mass of an exact strength that gains so many nats, 40 of them its base's."""
    exact = Strength(np.array([strength]), np.zeros((1, 1)))
    candidate = Candidate("mass", (terms("mass")[0],), gain, strength=exact)
    return with_evidence(scatter, {"mass": candidate}, 40.0)["mass"].evidence


def test_without_nominal_flights_the_gain_decides():
    assert evidence(None, 2.0) == 60.0


@pytest.mark.parametrize("strength", [0.5, 1.0, -0.5])
def test_rarity_limits_the_gain(strength):
    """Student's log density at 0 over that at the strength."""
    rarity = 0.5 * (FREEDOM + 1.0) * np.log1p((strength / RMS) ** 2 / FREEDOM)
    assert evidence(NOMINAL, strength) == pytest.approx(rarity)
    assert evidence(NOMINAL, strength, 40.0 + 0.1 * rarity) == pytest.approx(0.1 * rarity), "which is less"


@pytest.mark.parametrize("scatter", [None, NOMINAL])
def test_a_strength_at_its_bound_is_no_evidence(scatter):
    (high,) = terms("mass")[0].bounds()[1]
    assert evidence(scatter, high) == 0.0
    assert evidence(scatter, high, 30.0) == -10.0
