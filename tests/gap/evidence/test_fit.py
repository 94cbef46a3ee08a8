"""Fits of effects together, and strengths of random effects: the likeliest, as certain as the spectra say."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.evidence import fit as fit_module
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import LEAST_TURN_GAIN, converged, fit
from airtouch.gap.evidence.gauss_newton import gauss_newton
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.likelihood import REPLAY_FREEDOM
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.evidence.random_strength import LEAST_STRENGTH, fit_strength, strength_variance
from airtouch.gap.flights.flight import without_columns
from airtouch.gap.signals.channels import COUNT
from airtouch.gap.signals.spectra import OVERLAP_WEIGHT
from airtouch.gap.signatures import candidates
from gap_flights import VEHICLE, fly
from hovers import FLOOR, hover


def test_a_turn_whose_offsets_are_far_from_their_prior_is_not_the_highest(monkeypatch):
    """The second turn scales offsets, of a prior of 0.002 m/s^2, to where the likelihood alone is highest."""
    study = replace(FLOOR, floor=replace(FLOOR.floor, offset=np.where(np.arange(COUNT) < 3, 0.002, 0.0)))
    terms = (candidates.terms("mass")[0], *candidates.terms("imu_noise"))
    data = Data(study, [hover(i, (0.04 * sign, 0.0, -0.5), louder=1.5, length_s=12.0, name=str(i))
                        for i, sign in ((1, 1.0), (2, -1.0))])
    problem, turns = problem_of(data, whole_of(data)), []

    def astray(posterior, x, *more):
        turn = gauss_newton(posterior, x, *more)
        if turns:
            at_once = [posterior.at(turns[0].x, by * turns[0].offsets) for by in np.arange(1.0, 9.0, 0.5)]
            likeliest = max(at_once, key=lambda p: problem.likelihood(p.residual, p.extra_power))
            turn = turns[0]._replace(offsets=likeliest.offsets, residual=likeliest.residual)
        turns.append(turn)
        return turn

    monkeypatch.setattr(fit_module, "gauss_newton", astray)
    result = fit(data, whole_of(data), terms)
    assert len(turns) == 2
    strengths = [fit_strength(problem, terms[1], turn.residual, np.zeros(len(turn.residual))) for turn in turns]
    levels = [problem.likelihood(turn.residual, problem.random_power([strength]))
              for turn, strength in zip(turns, strengths, strict=True)]
    priors = [0.5 * np.sum((turn.offsets / 0.002) ** 2) for turn in turns]
    assert levels[1] > levels[0] + 1.0 and levels[1] - priors[1] < levels[0] - priors[0] - 1.0
    assert result.terms[1].values == pytest.approx(strengths[0].values)


def test_a_gain_beside_noise_is_fitted_where_the_judged_likelihood_is_highest(study):
    """The loop answers the noise too: what it commands for that is not the gain's."""
    data = Data(study, fly(1, 7, {"imu_noise": {"factor": 2.0}, "controller_gain": {"rate": 0.7}}))
    (gain,) = (t for t in candidates.terms("controller_gain") if t.free == ("rate",))
    blocks = whole_of(data)
    fitted, noise = fit(data, blocks, (gain, *candidates.terms("imu_noise"))).terms
    rates = [fitted.values["rate"] + by for by in (-0.04, 0.0, 0.04)]
    lower, there, higher = (judge(data, blocks, (replace(fitted, values={**fitted.values, "rate": rate}), noise))
                            for rate in rates)
    assert there > lower and there > higher


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


def test_the_turn_of_the_highest_posterior_is_returned(monkeypatch):
    """The second turn is led astray by five natural steps: the first is returned, with the strength that it has."""
    terms = (candidates.terms("mass")[0], *candidates.terms("imu_noise"))
    data = Data(FLOOR, [hover(1, (0.0, 0.0, -0.5), louder=1.5)])
    blocks, turns = whole_of(data), []

    def astray(posterior, x, *more):
        turn = gauss_newton(posterior, x, *more)
        if turns:
            far = turn.x + 5.0
            turn = turn._replace(x=far, residual=problem_of(data, blocks).residual([terms[0].fitted(far).active()]))
        turns.append(turn)
        return turn

    monkeypatch.setattr(fit_module, "gauss_newton", astray)
    result = fit(data, blocks, terms)
    assert len(turns) == 2 and np.array_equal(result.scaled, turns[0].x)
    assert result.terms[0].values["fraction"] == terms[0].fitted(turns[0].x).values["fraction"]
    mean, noise = result.terms
    levels = [judge(data, blocks, [mean, replace(noise, values={"factor": noise.values["factor"] * by})])
              for by in (0.95, 1.0, 1.05)]
    assert np.argmax(levels) == 1


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
    assert judge(data, blocks, refit.terms) < level + LEAST_TURN_GAIN
    assert level > judge(data, blocks, [term.fitted(term.scaled(true))]) - LEAST_TURN_GAIN


@pytest.mark.parametrize(("louder", "beside"), [(1.5, 0.0), (1.02, 0.0), (1.5, 0.5), (0.7, 0.0)])
def test_strength_of_a_random_effect_is_the_likeliest(louder, beside):
    """Against the best of a thousand strengths by the whole likelihood; one is less than the floor has."""
    data = Data(FLOOR, [hover(1, louder=louder, length_s=12.0)])
    problem = problem_of(data, whole_of(data))
    (noise,) = candidates.terms("imu_noise")
    residual, other = problem.elements.residual, beside * problem.elements.floor_power
    likeliest = fit_strength(problem, noise, residual, other)
    strengths = np.geomspace(LEAST_STRENGTH, 5.0, 1000)
    terms = [noise.fitted(np.full(1, x)) for x in strengths]
    levels = [problem.likelihood(residual, other + problem.random_power([t])) for t in terms]
    best = strengths[int(np.argmax(levels))]
    assert noise.scaled(likeliest.values)[0] == pytest.approx(best, rel=0.01)
    level = problem.likelihood(residual, other + problem.random_power([likeliest]))
    assert level > max(levels) - 1e-2 and (best > 2.0 * LEAST_STRENGTH) == (louder > 1.0)


def test_a_random_effect_that_adds_no_power_stays_as_it_is():
    data = Data(FLOOR, [hover(1, length_s=12.0)])
    problem = problem_of(data, whole_of(data))
    (noise,) = candidates.terms("imu_noise")
    elsewhere = replace(noise, gate=(("another flight", 0.0, 12.0),))
    residual = problem.elements.residual
    assert fit_strength(problem, elsewhere, residual, np.zeros(len(residual))) is elsewhere


def test_variance_is_the_inverse_of_the_information_of_the_strength():
    """Whittle's information of the logarithm of a strength x, sum (d log P / d log x)^2, by differences of the power P.

    Tails leave nu / (nu + 2) of it or a little more; the curvature of one flight scatters about that.
    """
    data = Data(FLOOR, [hover(3, louder=1.5, length_s=20.0)])
    blocks, problem = whole_of(data), problem_of(data, whole_of(data))
    (noise,) = candidates.terms("imu_noise")
    likeliest = fit_strength(problem, noise, problem.elements.residual, np.zeros(len(problem.elements.residual)))
    x, step = likeliest.scaled(likeliest.values), 1e-3
    up, down = (np.log(problem.elements.floor_power + problem.random_power([noise.fitted(x * np.exp(h))]))
                for h in (step, -step))
    information = OVERLAP_WEIGHT * np.sum((((up - down) / (2.0 * step)) ** 2)[problem.elements.valid])
    with_tails = float(x[0] ** 2 / strength_variance(data, blocks, [likeliest], likeliest)[0, 0]) / information
    assert 0.9 * REPLAY_FREEDOM / (REPLAY_FREEDOM + 2.0) < with_tails < 1.1
