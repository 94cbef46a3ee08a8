"""Fits of effects: wherever they begin, they end where the likelihood is highest."""

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import SETTLED, converged, fit
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.flights.flight import without_columns
from airtouch.gap.signatures import candidates
from gap_flights import VEHICLE, fly


@pytest.mark.parametrize("start", [0.05, 3.0])
def test_mean_and_random_part_do_not_depend_on_where_the_fit_begins(study, start):
    truth = {"strength": 1.0, "turbulence": 0.3}
    data = Data(study, fly(1, 53, {"ground_effect": truth}))
    (mean,) = candidates.terms("ground_effect")[:1]
    terms = (mean, candidates.random_part_of("ground_effect"))
    blocks = whole_of(data)
    free, begun = fit(data, blocks, terms), fit(data, blocks, terms, np.array([start]))
    assert judge(data, blocks, begun.terms) == pytest.approx(judge(data, blocks, free.terms), abs=1.0)
    assert begun.scaled == pytest.approx(free.scaled, rel=0.03)
    assert begun.terms[1].values["turbulence"] == pytest.approx(free.terms[1].values["turbulence"], rel=0.03)


def test_a_fit_goes_on_until_it_stands_still(study):
    """A battery's strength, charge and capacity lie along a bent valley; from its bottom nothing more is gained."""
    true = {"strength": 1.3, "charge": 0.7, "capacity": 1.0}
    data = Data(study, [without_columns(f, VEHICLE, ("vbat_V",)) for f in fly(1, 912, (("battery_sag", true),))])
    blocks, term = whole_of(data), candidates.terms("battery_sag")[0].refined()
    start = fit(data, blocks, [term], term.scaled({"strength": 0.9, "charge": 0.6, "capacity": 0.6}))
    result = converged(data, blocks, start)
    refit = fit(data, blocks, result.terms, result.scaled)
    level = judge(data, blocks, result.terms)
    assert level > judge(data, blocks, start.terms) + 1.0  # else this flight tests nothing
    assert judge(data, blocks, refit.terms) < level + SETTLED
    assert level > judge(data, blocks, [term.fitted(term.scaled(true))]) - SETTLED
