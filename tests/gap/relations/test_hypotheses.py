"""Several effects, or something without a name, against densities in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from airtouch.gap.relations.hypotheses import NAMELESS_LENGTHS, FlightHypotheses, LearnedModel
from axis_library import Q, library, noise


def test_evidence_of_two_effects_that_do_not_meet_is_the_sum_of_each():
    features = FlightHypotheses(noise() + 20.0 * np.eye(Q)[0] + 10.0 * np.eye(Q)[1], library().model)
    single = {h.names[0]: h for h in features.single_effects()}
    both = next(h for h in features.with_one_more(single["mass"], lambda c, _: c.name == "wind"))
    assert both.evidence == pytest.approx(single["mass"].evidence + single["wind"].evidence, abs=0.05)


@pytest.mark.parametrize("size", [0.0, 3.0])
def test_no_effect_is_a_hypothesis_as_any(size):
    """It rescales nothing and shifts nothing: its evidence over none is 0, the distance is that of the flight."""
    flight = FlightHypotheses(noise() + size, library().model)
    none = flight.at_fits(())
    np.testing.assert_array_equal(flight.rescaling(())(flight.values), flight.values)
    assert (none.log_likelihood_ratio, none.evidence) == (0.0, 0.0) and flight.rescaling(()).log_determinant == 0.0
    assert flight.squared_distance(none) == pytest.approx(np.sum(flight.values ** 2))
    alone, added = flight.single_effects(), flight.with_one_more(none, lambda c, h: True)
    assert [h.names for h in added] == [h.names for h in alone]
    assert [h.evidence for h in added] == pytest.approx([h.evidence for h in alone])
    assert flight.refitted(alone[0]).log_likelihood_ratio == pytest.approx(alone[0].log_likelihood_ratio)


def test_something_without_a_name_is_a_mixture_of_normal_densities():
    of, values = library().model, 5.0 * noise(2)
    exact = logsumexp([multivariate_normal(np.zeros(Q), np.eye(Q) + s * s * of.nameless @ of.nameless.T).logpdf(values)
                       for s in NAMELESS_LENGTHS]) - np.log(len(NAMELESS_LENGTHS))
    features = FlightHypotheses(values, of)
    none = multivariate_normal(np.zeros(Q), np.eye(Q)).logpdf(values)
    assert features.nameless_evidence(features.no_effect) == pytest.approx(exact - none)


def test_two_effects_are_no_sum_by_a_share_of_the_smaller_one():
    interaction = 0.5 * np.eye(Q)[:, 5:6]
    model = replace(library().model, interaction=interaction)
    features = FlightHypotheses(noise() + 40.0 * np.eye(Q)[0] + 10.0 * np.eye(Q)[1], model)
    both = features.with_two(*model.classes[:2])
    smaller = np.linalg.norm(both.fits[1].shift)
    assert smaller == pytest.approx(10.0, abs=2.0)
    assert features.rescaling(both.fits)(np.eye(Q)[5])[5] == pytest.approx((1.0 + (0.5 * smaller) ** 2) ** -0.5)
    assert features.rescaling(both.fits[:1])(np.eye(Q)[5])[5] == pytest.approx(1.0)


def two_ways(cosine):
    """Two classes whose directions have this cosine, and a flight without noise that has 30 and 20 of them."""
    classes = library().model.classes[:2]
    ways = np.eye(Q)[0], cosine * np.eye(Q)[0] + np.sqrt(1.0 - cosine ** 2) * np.eye(Q)[1]
    model = LearnedModel(tuple(replace(c, table=np.tile(w, (1, 3, 1))) for c, w in zip(classes, ways, strict=True)),
                         np.zeros((Q, 0)), np.zeros((Q, 0)))
    return model, FlightHypotheses(30.0 * ways[0] + 20.0 * ways[1], model)


def test_effects_fitted_in_turn_come_near_the_two_that_are_there():
    """Each round leaves a share cosine^2 = 1/4 of the error of 15 and 7.5: three leave a 32nd and a 64th of 15."""
    model, flight = two_ways(0.5)
    start = flight.at_fits([flight.with_class(c).fits[0] for c in model.classes])  # projections: 40 and 35
    assert [f.strength[0] for f in start.fits] == pytest.approx([40.0, 35.0], rel=5e-3)  # the grid is that fine
    refitted = flight.refitted(start)
    errors = [abs(f.strength[0] - true) for f, true in zip(refitted.fits, (30.0, 20.0), strict=True)]
    assert errors == pytest.approx([15.0 / 32.0, 15.0 / 64.0], abs=0.08)


def test_effects_are_not_refitted_to_something_less_likely():
    """Classes flown up to 50: strengths of 60 and 40 explain the flight whole, and a fit would cut the first."""
    model, flight = two_ways(0.0)
    flight = FlightHypotheses(2.0 * flight.values, model)
    whole = flight.at_fits([replace(flight.with_class(c).fits[0], strength=np.array([s]))
                            for c, s in zip(model.classes, (60.0, 40.0), strict=True)])
    assert flight.refitted(whole) is whole
    nearest = flight.with_two(*model.classes).log_likelihood_ratio
    assert nearest == pytest.approx(whole.log_likelihood_ratio - 0.5 * 10.0 ** 2, abs=0.5)
