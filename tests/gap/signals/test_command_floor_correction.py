"""The correction of the commands' floor, where theory gives it: one shape, all values a small step off the floor."""

import numpy as np
import pytest

from airtouch.gap.loop.command_spectra import COMMAND_FREEDOM, command_frequencies
from airtouch.gap.loop.controller import AXES
from airtouch.gap.signals import command_floor_correction
from airtouch.gap.signals.command_floor_correction import COMMAND_DOUBT, SPREAD, UNCERTAIN_FACTOR, correction_of

BLOCKS = 3
STEP = np.linspace(-0.004, 0.004, len(AXES))  # nepers by which the floor is off, by axis


@pytest.fixture
def level_alone(monkeypatch):
    """One shape: the level."""
    monkeypatch.setattr(command_floor_correction, "SHAPES", 1)
    monkeypatch.setattr(command_floor_correction, "smooth_shapes", lambda: np.ones((1, len(command_frequencies()))))


def tables(factor):
    """The floor, and what a hypothesis multiplies it by: `factor` in every bin; (bins, AXES) each."""
    floor = np.outer(np.linspace(1.0, 3.0, len(command_frequencies())), np.arange(1.0, len(AXES) + 1.0))
    return floor, np.full(floor.shape, factor)


@pytest.mark.parametrize("factor", [1.0, 1.6])
@pytest.mark.parametrize("uncertain_floor", [False, True])
def test_a_level_is_shrunk_as_a_normal_mean_with_a_normal_prior(level_alone, factor, uncertain_floor):
    """A small step d, seen with information k under a prior of variance v, is taken for d k v / (1 + k v)."""
    floor, ratio = tables(factor)
    correction = correction_of(np.tile(floor * ratio * np.exp(STEP), (BLOCKS, 1, 1)), floor, ratio, uncertain_floor)
    values = 0.5 * BLOCKS * len(floor)  # half overlapping blocks hold every sample twice
    of_tails = values * COMMAND_FREEDOM / (COMMAND_FREEDOM + 1.0)  # information of a Student-like value about its power
    variance = (SPREAD[0] * (UNCERTAIN_FACTOR if uncertain_floor else 1.0)) ** 2 + (COMMAND_DOUBT * np.log(factor)) ** 2
    level = STEP * of_tails * variance / (1.0 + of_tails * variance)
    np.testing.assert_allclose(correction.log_power, np.broadcast_to(level, floor.shape), rtol=0.01, atol=1e-9)
    occam = 0.5 * len(AXES) * np.log1p(values * variance)
    assert correction.cost == pytest.approx(0.5 * (level ** 2).sum() / variance + occam, rel=1e-4)
    np.testing.assert_allclose(correction.covariance, 1.0 / (values + 1.0 / variance))


def test_the_cost_is_what_the_mean_over_the_prior_takes_from_the_likelihood_at_its_best(level_alone):
    """By quadrature over the level; Laplace's information is that of exponential laws, a twentieth more than theirs."""
    floor, ratio = tables(1.0)
    power = floor * np.exp(0.15) * np.random.default_rng(1).exponential(size=(BLOCKS, *floor.shape))
    correction = correction_of(power, floor, ratio, False)

    def log_likelihood(level, axis):
        over = power[:, :, axis] / floor[:, axis] / np.exp(level)
        return -0.5 * (level + (COMMAND_FREEDOM + 1.0) * np.log1p(over / COMMAND_FREEDOM)).sum()

    levels = np.linspace(-8.0, 8.0, 801) * SPREAD[0]
    prior = np.exp(-0.5 * (levels / SPREAD[0]) ** 2)
    cost = 0.0
    for axis in range(len(AXES)):
        best = log_likelihood(correction.log_power[0, axis], axis)
        likelihood = np.array([np.exp(log_likelihood(x, axis) - best) for x in levels])
        cost -= np.log((likelihood * prior).sum() / prior.sum())
    assert cost > 1.0
    assert correction.cost == pytest.approx(cost, abs=0.05 * len(AXES))
