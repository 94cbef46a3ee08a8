"""Free powers: against closed forms, and noise that no band alone tells from chance."""

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.problem import GROUPS
from airtouch.gap.naming.judging import halves
from airtouch.gap.unnamed import generic, powers
from gap_flights import fly


def test_power_factor_of_gaussian_values_is_their_power_and_stays_where_it_is_believed():
    rng = np.random.default_rng(1)
    n, groups = 4000, np.repeat([3, 7], 2000)
    power = np.where(groups == 3, 2.5, 0.4) * rng.exponential(size=n)
    free, level = powers.power_factors(power, np.full(n, 1e6), np.full(n, 1e6), groups, *powers.LOOSE)
    np.testing.assert_allclose(free[[3, 7]], np.log([2.5, 0.4]), atol=4.0 / np.sqrt(2000))
    still, at_rest = powers.power_factors(power, np.full(n, 1e6), np.full(n, 1e6), groups, np.zeros(GROUPS),
                                      np.full(GROUPS, 1e-6))
    np.testing.assert_allclose(still[[3, 7]], 0.0, atol=1e-3)
    expected = [0.5 * 2000 * (f - 1.0 - np.log(f)) for f in (2.5, 0.4)]  # Kullback-Leibler, half overlapping blocks
    np.testing.assert_allclose((level - at_rest)[[3, 7]], expected, rtol=0.15)


def test_what_may_be_there_gains_half_and_costs_log_two_at_most():
    assert powers.gain_at_even_odds(0.0) == 0.0
    np.testing.assert_allclose(powers.gain_at_even_odds(-50.0), -np.log(2.0))
    np.testing.assert_allclose(powers.gain_at_even_odds(50.0), 50.0 - np.log(2.0))


def test_a_little_noise_in_every_band_shows_in_the_sensors_sum(study, monkeypatch):
    """A tenth more power in every band of every sensor: no band alone tells it from chance."""
    data = Data(study, fly(1, 49, {"imu_noise": {"factor": 1.06}}))
    gain_of_sum = sum(generic.generic_gain(data, halves(data), [(), ()]))
    monkeypatch.setattr(powers, "_of_sensors", lambda powers, middle: middle)
    assert gain_of_sum > 15.0 > sum(generic.generic_gain(data, halves(data), [(), ()]))
