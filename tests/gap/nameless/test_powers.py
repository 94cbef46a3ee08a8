"""Free powers: against closed forms, and noise that no band alone tells from chance."""

from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.evidence.cells import CELLS
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.likelihood import tail_scale
from airtouch.gap.nameless import model, powers
from airtouch.gap.nameless.powers import Powers
from airtouch.gap.naming.judging import halves
from airtouch.gap.signals.channels import COUNT
from gap_flights import fly


def test_power_factor_of_gaussian_values_is_their_power_and_stays_where_it_is_believed():
    rng = np.random.default_rng(1)
    n, groups = 4000, np.repeat([3, 7], 2000)
    power = np.where(groups == 3, 2.5, 0.4) * rng.exponential(size=n)
    measured = Powers(power, np.full(n, 1e6), np.full(n, 1e6), groups)
    free, level = powers.power_factors(measured, *powers.NO_PRIOR)
    np.testing.assert_allclose(free[[3, 7]], np.log([2.5, 0.4]), atol=4.0 / np.sqrt(2000))
    still, at_rest = powers.power_factors(measured, np.zeros(CELLS), np.full(CELLS, 1e-6))
    np.testing.assert_allclose(still[[3, 7]], 0.0, atol=1e-3)
    expected = [0.5 * 2000 * (f - 1.0 - np.log(f)) for f in (2.5, 0.4)]  # Kullback-Leibler, half overlapping blocks
    np.testing.assert_allclose((level - at_rest)[[3, 7]], expected, rtol=0.15)


def drawn(nu, values, scatter, rng):
    """A flight's powers: exponential in each cell, each value twice, as half overlapping blocks hold every sample."""
    log_power = np.repeat(rng.normal(0.0, scatter, CELLS), values)
    power = np.tile(np.exp(log_power) * rng.exponential(size=len(log_power)), 2)
    freedom = np.full(len(power), nu)
    return Powers(power, freedom, tail_scale(freedom), np.tile(np.repeat(np.arange(CELLS), values), 2))


@pytest.mark.parametrize("nu", [2.0, 6.0, 12.0])
def test_the_scatter_of_log_power_is_that_which_flights_have_beyond_chance(nu):
    """A scatter of 0.2 in each of 3000 cells, beside chance of 0.14 to 0.16 from 50 values."""
    rng = np.random.default_rng(6)
    scatter, count = 0.2, 4
    floor = powers.power_floor([drawn(nu, 50, scatter, rng) for _ in range(count)])
    estimate = np.sqrt(np.mean(floor[1] ** 2) / (1.0 + 1.0 / count))
    assert estimate == pytest.approx(scatter, rel=0.05)


@pytest.mark.parametrize(("simulated", "counted"), [(True, [False, True]), (False, [False, False])])
def test_less_power_counts_above_the_means_of_simulated_flights(simulated, counted):
    gained, weaker = np.full(CELLS, 2.0 * powers.LEAST_COLUMN_GAIN), np.zeros(CELLS, bool)
    above = powers._above_chance(gained, weaker, np.arange(CELLS), simulated)
    assert above[[0, COUNT]].tolist() == counted, "the first channel's means, and its band above"
    assert not powers._above_chance(gained / 4.0, ~weaker, np.arange(CELLS), simulated).any()


def test_what_may_be_there_gains_half_and_costs_log_two_at_most():
    assert powers.gain_at_even_odds(0.0) == 0.0
    np.testing.assert_allclose(powers.gain_at_even_odds(-50.0), -np.log(2.0))
    np.testing.assert_allclose(powers.gain_at_even_odds(50.0), 50.0 - np.log(2.0))


def halves_of(factor, count=150):
    """Powers of two halves: all bands of the force but the means' have `factor` times the floor, and no band else."""
    rng = np.random.default_rng(4)
    bands = [band * COUNT + axis for band in range(1, 11) for axis in range(3)]
    groups = np.repeat(bands, count)
    certain = np.full(len(groups), 1e6)
    return [Powers(factor * rng.exponential(size=len(groups)), certain, certain, groups) for _ in range(2)]


def test_a_little_more_power_in_every_band_shows_in_the_sensors_sum():
    """A quarter more, of which a band holds two nats: no band alone tells it from chance, thirty together do."""
    factor, middle = 1.25, np.zeros(CELLS)
    floor = SimpleNamespace(power=np.stack([middle, np.full(CELLS, 0.05)]))
    trained, held_out = halves_of(factor)
    expected = 0.5 * 30 * 150 * (factor - 1.0 - np.log(factor)) - np.log(2.0)  # even odds that it is there
    assert powers.power_gain(trained, held_out, floor, True) == pytest.approx(expected, rel=0.25)
    assert powers.power_gain(trained, held_out, floor, False) < 0.1 * expected, "recorded: each band alone"
    assert powers.power_gain(*halves_of(1.0), floor, True) < 1.0


def test_a_little_noise_of_the_imu_is_no_chance_in_a_simulated_flight(study):
    """A tenth more power in every band of every sensor."""
    data = Data(study, fly(1, 49, {"imu_noise": {"factor": 1.06}}))
    assert sum(model.held_out_gains(data, halves(data), [(), ()])) > 15.0
