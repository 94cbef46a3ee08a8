"""The floor of nominal flights, of white noise whose mean and variance are known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import quad

from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.flights.hardness import Slopes
from airtouch.gap.signals.channels import COUNT, FORCE, RATE, TORQUE
from airtouch.gap.signals.floor import (
    FEWEST_BLOCKS,
    LEAST_FLOOR,
    LEAST_LEFT,
    UNKNOWN_FLOOR,
    Floor,
    NominalBlocks,
    floor_of,
    sensor_power,
)
from airtouch.gap.signals.spectra import AIR, LENGTH, REST, frequencies, short_time_spectra, starts
from gap_flights import flight

RMS = 0.5
SENSORS = np.concatenate([np.full(3, 0.05), np.full(6, 0.002), np.zeros(4)])  # rms of force, torque and rate


def nominal_of(one, residual, bridging=0.0):
    """Blocks of a flight with a residual (n, COUNT) to which lost rows add a power."""
    first = {r: starts(one, r) for r in (AIR, REST)}
    spectra = {r: short_time_spectra(residual, begin, r) for r, begin in first.items()}
    return NominalBlocks(one, residual, first, spectra, np.full(spectra[AIR].shape, bridging))


def white(seconds, seed, rms=RMS, resting_s=0.0):
    """A flight with white noise in every channel."""
    noise = np.random.default_rng(seed).normal(0.0, rms, (round(seconds / PERIOD_S), COUNT))
    return flight(seconds, resting_s=resting_s), noise


def test_means_of_flights_differ_beyond_chance_only_by_what_their_trims_do():
    """White noise alone leaves nothing between flights; trims are found as they were drawn."""
    rng, rms, length_s, count = np.random.default_rng(5), 0.5, 30.0, 200
    flights = [flight(length_s) for _ in range(count)]
    trims = rng.normal(0.0, 0.02, count)

    def offset(trim):
        residuals = [np.tile(t + rng.normal(0.0, rms, (len(f), 1)), COUNT) for t, f in zip(trim, flights, strict=True)]
        nominal = [nominal_of(f, x) for f, x in zip(flights, residuals, strict=True)]
        return floor_of(nominal, np.zeros(COUNT)).offset_beyond[0]

    chance = rms / np.sqrt(length_s / PERIOD_S)
    assert offset(0.0 * trims) < 0.4 * chance
    assert offset(trims) == pytest.approx(0.02, rel=0.15)


def test_the_floor_of_white_noise_is_its_density_in_both_states():
    """600 s in the air, 60 s at rest; the highest bin, at half the rate, has half of it, as in every such density."""
    floor = floor_of([nominal_of(*white(660.0, 1, resting_s=60.0))], np.zeros(COUNT))
    density = 2.0 * PERIOD_S * RMS ** 2
    for state in (AIR, REST):
        inside = floor.power[state][2:-8]  # which smoothing keeps clear of both ends
        scatter = 1.5 / np.sqrt(floor.block_counts[state])  # of a bin's mean; half overlapping blocks are no fresh ones
        assert np.abs(inside / density - 1.0).max() < 4.0 * scatter
        assert inside.mean() == pytest.approx(density, rel=0.02)


def test_the_floor_of_few_blocks_is_as_often_too_high_as_too_low():
    """40 flights of six blocks each; smoothed in the logarithm, mean powers of six would be 8 % too low."""
    floors = [floor_of([nominal_of(*white(9.0, seed))], np.zeros(COUNT)) for seed in range(40)]
    assert {f.block_counts[AIR] for f in floors} == {6}
    inside = np.array([f.power[AIR][2:-8] for f in floors]) / (2.0 * PERIOD_S * RMS ** 2)
    assert np.log(inside).mean() == pytest.approx(0.0, abs=0.015)


def test_the_bins_of_the_means_are_not_smoothed():
    one, noise = white(60.0, 2)
    nominal = nominal_of(one, noise + 5.0)
    power = np.mean(np.abs(nominal.spectra[AIR]) ** 2, axis=0)
    floor = floor_of([nominal], np.zeros(COUNT)).power[AIR]
    ratio = floor / power  # the same in all bins of a channel where nothing is smoothed: blocks are levelled alike
    np.testing.assert_allclose(ratio[:2, TORQUE.start:], 1.0, rtol=1e-9)
    assert np.abs(ratio[2:, TORQUE.start:] - 1.0).max() > 0.1


def test_no_measured_floor_is_below_a_share_of_the_sensors_noise():
    floor = floor_of([nominal_of(*white(60.0, 3, 1e-9, 20.0))], SENSORS)
    for state in (AIR, REST):
        np.testing.assert_allclose(floor.power[state], LEAST_FLOOR * sensor_power(SENSORS, state), atol=1e-15)
    np.testing.assert_allclose(floor.least_power, LEAST_FLOOR * sensor_power(SENSORS, AIR))


@pytest.mark.parametrize("blocks", [FEWEST_BLOCKS - 1, FEWEST_BLOCKS])
def test_a_state_of_too_few_blocks_has_the_floor_of_the_sensors_alone(blocks):
    seconds = (blocks + 1) * LENGTH[AIR] / 2 * PERIOD_S
    floor = floor_of([nominal_of(*white(seconds, 4))], SENSORS)
    assert floor.block_counts == {AIR: blocks, REST: 0}
    for state in (AIR, REST):
        measured = floor.block_counts[state] >= FEWEST_BLOCKS
        assert np.array_equal(floor.power[state], UNKNOWN_FLOOR * sensor_power(SENSORS, state)) != measured
    assert (floor.slopes is None) == (blocks < FEWEST_BLOCKS)


def test_the_power_of_lost_rows_is_taken_off_to_what_is_left_at_least():
    """The power of a bin over its density is exponential; what is left of it on average, by quadrature."""
    one, noise = white(600.0, 5)
    density, lost = 2.0 * PERIOD_S * RMS ** 2, 0.9
    floors = [floor_of([nominal_of(one, noise, x * density)], np.zeros(COUNT)).power[AIR] for x in (0.0, lost, 1e3)]
    np.testing.assert_allclose(floors[2], LEAST_LEFT * floors[0], rtol=1e-9)
    left, _ = quad(lambda e: np.exp(-e) * max(e - lost, LEAST_LEFT * e), 0.0, 50.0, points=[lost / (1.0 - LEAST_LEFT)])
    assert floors[1][2:-8].mean() == pytest.approx(left * density, rel=0.03)


def test_the_clock_and_the_lost_rows_are_those_of_all_samples_together():
    one, noise = white(10.0, 7)
    lost = np.arange(1000) < 50
    flights = [replace(one, clock_s=np.full(1000, 0.003)), replace(one, clock_s=np.full(3000, -0.001), lost=lost)]
    floor = floor_of([nominal_of(f, noise) for f in flights], np.zeros(COUNT))
    assert floor.clock_s == pytest.approx(np.sqrt((1000 * 0.003 ** 2 + 3000 * 0.001 ** 2) / 4000))
    assert floor.lost == pytest.approx(50 / 2000)


def test_one_flight_has_no_offset_between_flights():
    floor = floor_of([nominal_of(*white(30.0, 8))], np.zeros(COUNT))
    assert not floor.offset.any() and not floor.offset_beyond.any()


def test_a_block_flown_harder_has_the_power_that_the_slopes_say_in_the_air_alone():
    """A tilt that swings makes the power of a slope of 1 as many times as large as exp(hardness)."""
    hover = flight(2 * LENGTH[AIR] * PERIOD_S)
    turned = hover.body_to_world.copy()
    swing = np.radians(4.0) * np.sin(2.0 * np.pi * np.arange(LENGTH[AIR]) / 64.0)  # in the second block
    turned[LENGTH[AIR]:, 2, 0] = np.sin(swing)
    hardness = 0.5 * np.log1p(np.var(np.sin(swing)) / np.radians(1.0) ** 2)
    shape = len(frequencies(AIR)), COUNT
    slopes = Slopes(np.where(np.arange(COUNT) < TORQUE.start, 1.0, 0.0) * np.ones(shape), 0.0, 0.0, 5.0)
    power = {AIR: np.full(shape, 2.0), REST: np.full((len(frequencies(REST)), COUNT), 3.0)}
    floor = Floor(power, {AIR: 9, REST: 9}, np.zeros(COUNT), 0.0, 0.0, slopes, least_power=np.zeros(shape))
    first = np.array([0, LENGTH[AIR]])
    calm, hard = floor.of_blocks(replace(hover, body_to_world=turned), first, AIR)
    np.testing.assert_array_equal(calm, power[AIR])
    np.testing.assert_allclose(hard[:, FORCE], 2.0 * np.exp(hardness))
    np.testing.assert_array_equal(hard[:, TORQUE.start:], 2.0)
    np.testing.assert_array_equal(floor.of_blocks(hover, first, REST), np.stack([power[REST]] * 2))
    raised = replace(floor, least_power=2.5)
    np.testing.assert_array_equal(raised.of_blocks(hover, first, AIR), 2.5)


def test_the_sensors_noise_is_that_of_white_samples_and_of_their_differences():
    noise = np.random.default_rng(9).normal(size=(60000, COUNT)) * SENSORS
    differences = np.diff(noise[:, TORQUE], axis=0) / PERIOD_S
    power = sensor_power(SENSORS, AIR)
    for values, channels in ((noise[:, FORCE], FORCE), (noise[:, RATE], RATE), (differences, TORQUE)):
        f, density = signal.welch(values, 1.0 / PERIOD_S, "hann", LENGTH[AIR], detrend=False, axis=0)
        np.testing.assert_allclose(f, frequencies(AIR))
        np.testing.assert_allclose(power[3:-1, channels], density[3:-1], rtol=0.3)
        assert (power[3:-1, channels] / density[3:-1]).mean() == pytest.approx(1.0, rel=0.02)
    assert not power[:, RATE.stop:].any()
