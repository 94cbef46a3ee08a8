"""Blocks of a flight: where they begin, and the scale of their window, against the sums that define them."""

import numpy as np
import pytest

from airtouch.gap.flights.blocks import count_within, half_overlapping, hann_window, log_bias


def test_blocks_hold_no_marked_sample_and_overlap_by_half():
    marked = np.zeros(40, bool)
    marked[17] = True
    first = half_overlapping(count_within(marked, 8) == 0, 8)
    np.testing.assert_array_equal(first, [0, 4, 8, 18, 22, 26, 30])
    assert not any(marked[k:k + 8].any() for k in first)


@pytest.mark.parametrize("samples", [0, 7])
def test_a_flight_shorter_than_a_block_has_none(samples):
    assert len(half_overlapping(count_within(np.zeros(samples, bool), 8) == 0, 8)) == 0


def test_a_sine_has_its_power_under_the_window():
    window, scale = hann_window(256)
    sine = np.sqrt(2.0) * np.sin(2.0 * np.pi * 10 / 256 * np.arange(256))[:, None]  # mean square 1
    density = np.abs(np.fft.rfft(sine * window, axis=0) * scale) ** 2
    assert density.sum() * 100.0 / 256 == pytest.approx(1.0)


def test_the_bias_of_a_logarithm_is_that_of_means_of_exponential_powers():
    powers = np.random.default_rng(0).exponential(1.0, (200_000, 6))
    means = [np.log(powers[:, :n].mean(axis=1)).mean() for n in (1, 2, 6)]
    np.testing.assert_allclose(log_bias(np.array([1, 2, 6])), means, atol=0.006)
