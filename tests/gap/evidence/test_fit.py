"""Fits of effects: wherever they begin, they end where the likelihood is highest; the strength of a random one."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import LEAST_STRENGTH, fit, judge, strongest
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.signatures import candidates
from gap_flights import fly
from hovers import FLOOR, hover


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


@pytest.mark.parametrize(("louder", "beside"), [(1.5, 0.0), (1.02, 0.0), (1.5, 0.5), (0.7, 0.0)])
def test_strength_of_a_random_effect_is_the_likeliest(louder, beside):
    """Against the best of a thousand strengths by the whole likelihood; one is less than the floor has."""
    data = Data(FLOOR, [hover(1, louder=louder, length_s=12.0)])
    problem = problem_of(data, whole_of(data))
    (noise,) = candidates.terms("imu_noise")
    values, other = problem.elements.base, beside * problem.elements.power
    found = strongest(problem, noise, values, other)
    strengths = np.geomspace(LEAST_STRENGTH, 5.0, 1000)
    terms = [noise.fitted(np.full(1, x)) for x in strengths]
    levels = [problem.likelihood(values, other + problem.random_power([t])) for t in terms]
    best = strengths[int(np.argmax(levels))]
    assert noise.scaled(found.values)[0] == pytest.approx(best, rel=0.01)
    level = problem.likelihood(values, other + problem.random_power([found]))
    assert level > max(levels) - 1e-2 and (best > 2.0 * LEAST_STRENGTH) == (louder > 1.0)


def test_a_random_effect_that_adds_no_power_stays_as_it_is():
    data = Data(FLOOR, [hover(1, length_s=12.0)])
    problem = problem_of(data, whole_of(data))
    (noise,) = candidates.terms("imu_noise")
    elsewhere = replace(noise, gate=(("another flight", 0.0, 12.0),))
    assert strongest(problem, elsewhere, problem.elements.base, np.zeros(len(problem.elements.base))) is elsewhere
