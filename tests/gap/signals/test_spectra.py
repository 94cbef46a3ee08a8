"""Short-time spectra against SciPy's, their blocks and the bins that count."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.signals.channels import CHANNELS, COLUMN, COUNT
from airtouch.gap.signals.spectra import (
    AIR,
    LENGTH,
    MOST_LOST,
    REST,
    difference_power,
    frequencies,
    judged_bins,
    short_time_spectra,
    squared,
    starts,
)
from gap_flights import flight

RATE_HZ = 1.0 / PERIOD_S


def blocks(samples, state):
    """First samples of all half overlapping blocks."""
    return np.arange(0, samples - LENGTH[state] + 1, LENGTH[state] // 2)


@pytest.mark.parametrize("state", [AIR, REST])
def test_the_mean_power_is_welchs_one_sided_density(state):
    values = 3.0 + np.random.default_rng(1).normal(size=(1000, 2)).cumsum(axis=0)
    spectra = short_time_spectra(values, blocks(1000, state), state)
    f, density = signal.welch(values, RATE_HZ, "hann", LENGTH[state], detrend=False, axis=0)
    np.testing.assert_allclose(frequencies(state), f)
    np.testing.assert_allclose(np.mean(np.abs(spectra) ** 2, axis=0), density, rtol=1e-9)


@pytest.mark.parametrize("state", [AIR, REST])
def test_one_block_is_a_periodogram_and_its_phase_that_of_the_fourier_transform(state):
    values = np.random.default_rng(2).normal(size=(LENGTH[state] + 10, 1))
    spectrum = short_time_spectra(values, np.array([10]), state)[0, :, 0]
    block = values[10:, 0]
    _, density = signal.periodogram(block, RATE_HZ, "hann", detrend=False)
    np.testing.assert_allclose(squared(spectrum), density, rtol=1e-9)
    transform = np.fft.rfft(block * signal.get_window("hann", len(block)))
    np.testing.assert_allclose(np.angle(spectrum / transform), 0.0, atol=1e-9)


@pytest.mark.parametrize("state", [AIR, REST])
def test_a_constant_stands_in_the_lowest_bin_by_the_root_of_the_duration_over_the_windows_bandwidth(state):
    """The Hann window's noise bandwidth is 1.5 bins."""
    spectra = short_time_spectra(np.full((LENGTH[state], 1), -0.7), np.array([0]), state)
    assert spectra[0, 0, 0] == pytest.approx(-0.7 * np.sqrt(LENGTH[state] * PERIOD_S / 1.5))
    np.testing.assert_allclose(spectra[0, 2:, 0], 0.0, atol=1e-12)  # the window spreads it over two bins


def test_a_flight_without_blocks_has_spectra_of_no_block():
    assert short_time_spectra(np.ones((100, 3)), np.zeros(0, int), AIR).shape == (0, LENGTH[AIR] // 2 + 1, 3)


def test_blocks_in_the_air_and_at_rest_are_cut_where_the_vehicle_is_so_throughout():
    """3 s at rest, 7 s in the air: half overlapping blocks from the first sample of each on."""
    both = flight(10.0, resting_s=3.0)
    rest, air = starts(both, REST), starts(both, AIR)
    np.testing.assert_array_equal(rest, blocks(300, REST))
    np.testing.assert_array_equal(air, 300 + blocks(700, AIR))
    running = replace(both, pwm=np.full_like(both.pwm, 1.0))  # on the ground, not at rest: neither state
    assert not len(starts(running, REST))
    np.testing.assert_array_equal(starts(running, AIR), air)


def test_a_sample_that_is_neither_usable_nor_bridged_ends_a_block():
    hover = flight(10.0)
    usable = np.arange(1000) != 400
    np.testing.assert_array_equal(starts(replace(hover, usable=usable), AIR), [0, 128, *(401 + blocks(599, AIR))])


@pytest.mark.parametrize("over", [0, 1])
def test_a_block_may_have_its_share_of_bridged_samples_and_not_one_more(over):
    lost = np.zeros(LENGTH[AIR], bool)
    lost[5:5 + int(MOST_LOST * LENGTH[AIR]) + over] = True
    one = flight(LENGTH[AIR] * PERIOD_S, lost=lost)
    assert len(starts(replace(one, usable=~lost), AIR)) == 1 - over


def test_in_the_air_a_channel_counts_in_its_band_and_the_yaw_rate_nowhere():
    counted, f = judged_bins(AIR), frequencies(AIR)
    assert counted.shape == (len(f), COUNT)
    assert counted[:, :6].all()
    for name in ("rate_x", "rate_y"):
        np.testing.assert_array_equal(counted[:, COLUMN[name]], f <= 0.3)
    assert not counted[:, COLUMN["rate_z"]].any()
    for name in ("command_thrust", "command_roll", "command_pitch", "command_yaw"):
        np.testing.assert_array_equal(counted[:, COLUMN[name]], (f >= 0.6) & (f <= 30.0))


def test_at_rest_force_and_rate_count_in_every_bin_and_nothing_else():
    expected = [c.name[:4] in ("forc", "rate") for c in CHANNELS]
    np.testing.assert_array_equal(judged_bins(REST), np.tile(expected, (len(frequencies(REST)), 1)))


def test_differences_of_white_noise_have_the_power_of_their_filter():
    f, response = signal.freqz([1.0, -1.0], worN=frequencies(AIR), fs=RATE_HZ)
    np.testing.assert_allclose(difference_power(f), np.abs(response) ** 2, atol=1e-12)
