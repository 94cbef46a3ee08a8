"""Fits of a mean effect with its random part: wherever they begin, they end where the likelihood is highest."""

import numpy as np
import pytest

from airtouch.gap.evidence import problem
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import fit, judge
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.naming import judging
from airtouch.gap.naming.records import Candidate
from airtouch.gap.signatures import candidates
from gap_flights import fly


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


def test_a_random_effect_that_is_not_there_costs_one_of_the_commands_nothing(study):
    """Beside a random effect the commands' floor is less certain: a changed gain, seen in them alone, gains less."""
    data = Data(study, fly(1, 54, {"controller_gain": {"height": 0.5}}))
    on = judging.trial_of(data)
    gain = next(t for t in candidates.terms("controller_gain") if "height" in t.free)
    chosen = judging.cross_validated(on, judging.PricedVariant("controller_gain", (gain,), 0.0), None)
    certain, uncertain = (sum(judging.gain_of(on, test, chosen.fits[train].terms, wide)
                              for train, test in problem.TWO_FOLDS) for wide in (False, True))
    assert isinstance(chosen, Candidate) and certain > uncertain + 10.0
    vibration = judging.PricedVariant("vibration", (candidates.terms("vibration")[0],), 0.0)
    both = judging.cross_validated(on, vibration, chosen)
    assert both.gain == pytest.approx(chosen.gain, abs=2.0)
    assert both.charges.certainty_refund == pytest.approx(certain - uncertain)
