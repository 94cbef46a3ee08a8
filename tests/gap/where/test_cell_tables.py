"""Cells of the map against plain means, and their intervals against what they promise on random blocks."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from airtouch.gap.flights.flight import GROUND
from airtouch.gap.signals.channels import COUNT
from airtouch.gap.where import cell_tables
from airtouch.gap.where.band_sums import Sums
from airtouch.gap.where.filter_bank import MAP_BANDS_HZ
from airtouch.gap.where.regimes import REGIMES
from airtouch.logs.segments import KINDS

AIRBORNE, OTHER = [k for k in range(len(KINDS)) if k != GROUND][:2]


def blocks_of(rng, flights, blocks, samples=200, rms=1.0, offsets=None, phase=AIRBORNE):
    """Sums of white blocks, `blocks` a flight; the lowest band has two independent values a block and an offset."""
    n = flights * blocks
    flight = np.repeat(np.arange(flights), blocks)
    weight = np.zeros((n, len(REGIMES)))
    weight[:, 0] = samples
    power = np.zeros((n, len(REGIMES), len(MAP_BANDS_HZ), COUNT))
    power[:, 0] = samples * rms**2 * rng.chisquare(4, (n, len(MAP_BANDS_HZ), COUNT)) / 4
    mean = np.zeros((n, len(REGIMES), COUNT))
    values = np.zeros((n, COUNT)) if offsets is None else offsets[flight][:, None] * np.ones(COUNT)
    mean[:, 0], power[:, 0, 0] = samples * values, samples * values**2
    return Sums(np.full(n, phase), flight, weight, power, mean)


def test_rms_is_the_mean_weighted_by_samples():
    rng = np.random.default_rng(1)
    sums = blocks_of(rng, 3, 5)
    scale = rng.integers(1, 5, len(sums.flight)).astype(float)
    sums = Sums(sums.phase, sums.flight, sums.weight * scale[:, None], sums.power * scale[:, None, None, None],
                sums.mean * scale[:, None, None])
    table = cell_tables.table_of(sums, AIRBORNE, seed=0)
    for band in range(1, len(MAP_BANDS_HZ)):
        squares = sums.power[:, 0, band, 0] / sums.weight[:, 0]
        assert table.rms[0, band, 0] == pytest.approx(np.sqrt(np.average(squares, weights=sums.weight[:, 0])))
    assert table.seconds[0] == pytest.approx(0.01 * 200 * scale.sum()) and not table.seconds[1].any()
    assert (table.flights[0] == 3).all() and (table.blocks[0] == 15).all()


@pytest.mark.parametrize(("flights", "blocks"), [(1, 12), (8, 4)])
def test_nine_of_ten_intervals_hold_the_true_rms(flights, blocks):
    """On blocks of four independent values: 90 % intervals that may be wider, as blocks also differ, not narrower."""
    rng, covered = np.random.default_rng(2), []
    for draw in range(40):
        table = cell_tables.table_of(blocks_of(rng, flights, blocks), AIRBORNE, seed=draw)
        covered.append((table.low[0, 1:] <= 1.0) & (table.high[0, 1:] >= 1.0))
        assert (table.low <= table.rms + 1e-12).all() and (table.rms <= table.high + 1e-12).all()
    assert np.mean(covered) > 0.87


def test_a_phase_that_was_not_flown_has_no_table():
    assert cell_tables.table_of(blocks_of(np.random.default_rng(0), 2, 2), AIRBORNE + 1, seed=0) is None


def test_the_floor_of_an_offset_is_its_standard_deviation_between_flights():
    """Sample standard deviation, what all flights have in common taken off; at least the sensor's noise."""
    offsets = np.array([3.1, 2.9, 3.4, 2.7, 3.0, 3.3])
    sums = blocks_of(np.random.default_rng(3), len(offsets), 6, offsets=offsets)
    sensor = np.full((len(MAP_BANDS_HZ), COUNT), 0.01)
    level, top = cell_tables.floors_of(sums, sensor)[AIRBORNE]
    assert level[0, 0, 0] == pytest.approx(np.std(offsets, ddof=1))
    assert top[0, 0, 0] > level[0, 0, 0]
    level, _ = cell_tables.floors_of(sums, 10 * sensor + 1.0)[AIRBORNE]
    assert level[0, 0, 0] == pytest.approx(1.1)


@pytest.mark.parametrize("flights", [2, 3, 6])
def test_what_varies_within_a_flight_counts_once_in_the_floor_of_an_offset(flights):
    """Blocks at a mean of the flight +- 0.5: 0.5^2, and the sample variance of the flights' means."""
    means = np.random.default_rng(7).normal(3.0, 0.3, flights)
    sums = blocks_of(np.random.default_rng(3), flights, 6, offsets=means)
    values = means[sums.flight] + np.where(np.arange(len(sums.flight)) % 2, 0.5, -0.5)
    sums.mean[:, 0] = 200 * values[:, None]
    sums.power[:, 0, 0] = 200 * values[:, None] ** 2
    level, _ = cell_tables.floors_of(sums, np.full((len(MAP_BANDS_HZ), COUNT), 0.01))[AIRBORNE]
    assert level[0, 0, 0] ** 2 == pytest.approx(0.25 + np.var(means, ddof=1))


def test_the_floor_of_a_phase_that_few_flights_have_is_that_of_those_few():
    """Two of six flights: their sample standard deviation, over one flight less than two."""
    offsets = np.array([3.1, 2.7, 3.4, 2.9, 3.0, 3.3])
    sums = blocks_of(np.random.default_rng(3), len(offsets), 6, offsets=offsets)
    few = sums.flight < 2
    sums = replace(sums, phase=np.where(few, AIRBORNE, OTHER))
    level, _ = cell_tables.floors_of(sums, np.full((len(MAP_BANDS_HZ), COUNT), 0.01))[AIRBORNE]
    assert level[0, 0, 0] == pytest.approx(np.std(offsets[:2], ddof=1))


@pytest.mark.parametrize("samples", [200, 1])
def test_the_floor_of_a_regime_is_the_scatter_of_the_flights_that_have_it(samples):
    """Two of six flights: their standard deviation. One, or another for 0.06 s: that of all, as one has no scatter."""
    offsets = np.array([3.1, 1.6, 3.9, 2.4, 3.0, 2.2])
    sums = blocks_of(np.random.default_rng(3), len(offsets), 6, offsets=offsets)
    for regime, flights in ((1, [0, 1]), (2, [3, 4] if samples < 200 else [3])):
        for i in flights:
            share = (samples / 200 if i == 4 else 1.0) * (sums.flight == i)
            sums.weight[:, regime] += share * sums.weight[:, 0]
            sums.mean[:, regime] += share[:, None] * sums.mean[:, 0]
            sums.power[:, regime] += share[:, None, None] * sums.power[:, 0]
    level, top = cell_tables.floors_of(sums, np.full((len(MAP_BANDS_HZ), COUNT), 0.01))[AIRBORNE]
    assert level[0, 0, 0] == pytest.approx(np.std(offsets, ddof=1))
    assert level[1, 0, 0] == pytest.approx(np.std(offsets[:2], ddof=1))
    assert level[2, 0, 0] == level[0, 0, 0] and top[2, 0, 0] == top[0, 0, 0]
    alone = sums.power[sums.flight == 3, 0, 1, 0].sum() / sums.weight[sums.flight == 3, 0].sum()
    assert level[2, 1, 0] == pytest.approx(np.sqrt(alone), rel=0.01)  # nothing is taken off above the lowest band


def test_without_a_baseline_the_spread_between_flights_counts_beside_the_sensor():
    offsets = np.array([0.2, -0.1, 0.4])
    sums = blocks_of(np.random.default_rng(4), 3, 6, offsets=offsets)
    sensor = np.full((len(MAP_BANDS_HZ), COUNT), 0.3)
    level, _ = cell_tables.spreads_of(sums, sensor)[AIRBORNE]
    assert level[0, 0, 0] == pytest.approx(np.hypot(0.3, np.std(offsets, ddof=1)))


@pytest.mark.parametrize("share", [0.05, 0.5, 0.95])
def test_chi_square_is_scipys(share):
    freedom = np.array([1.0, 2.5, 40.0, 900.0])
    np.testing.assert_allclose(cell_tables.chi_square(share, freedom), chi2.ppf(share, freedom), rtol=1e-10)
