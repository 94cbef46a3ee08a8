"""How far a gap closes: its cells, its shrink and interval by closed forms, and that of a jitter."""

from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.answer.shrink import (
    FEWEST_VALUES,
    MARGIN,
    Gap,
    closure_of,
    closure_of_jitter,
    fraction_closed,
    gap_of,
    is_nearer_to_floor,
)
from airtouch.gap.evidence.cells import CELLS, REPLAY_VIEW, VIEW_STRIDE, cell_numbers
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.judge import CELL_GAIN, cell_gains
from airtouch.gap.evidence.problem import problem_of
from airtouch.gap.flights.blocks import BANDS_HZ
from airtouch.gap.flights.clock import LEAST_JITTER_S
from airtouch.gap.naming.judging import PricedVariant, cross_validated, halves, trial_of
from airtouch.gap.naming.records import Hypothesis
from airtouch.gap.signals.channels import COLUMN, TORQUE
from airtouch.gap.signals.spectra import AIR, frequencies
from airtouch.gap.signatures.candidates import terms
from hovers import FLOOR, hover

LIFT = COLUMN["force_z"]


@pytest.mark.parametrize(("before", "after", "fraction"), [
    (3.0, 1.0, 1.0), (3.0, 2.0, 0.5), (3.0, 3.0, 0.0), (3.0, 4.0, -0.5), (3.0, 9.0, -1.0), (3.0, 0.5, 1.0),
    (1.01, 1.0, 0.0), (1.0, 1.0, 0.0), (0.9, 1.0, 0.0), (1.03, 1.0, 1.0)])
def test_the_fraction_closed_is_that_of_the_rms_over_the_floor(before, after, fraction):
    """Rms values of 3 and 2 floors: half of what is over the floor is gone."""
    assert fraction_closed(before ** 2, after ** 2) == pytest.approx(fraction)


def jittered(rms_of_eighths, floor_s=0.0):
    """A stand-in for the data of one flight whose logged times jitter by so much in each eighth of it, s rms."""
    clock = np.concatenate([np.full(100, rms) for rms in rms_of_eighths])
    return SimpleNamespace(flights=[SimpleNamespace(clock_s=clock)],
                           study=SimpleNamespace(floor=SimpleNamespace(clock_s=floor_s)))


def test_a_jitter_that_both_halves_share_closes_wholly():
    closure = closure_of_jitter(jittered([0.004] * 8, floor_s=0.001))
    assert (closure.before, closure.after, closure.shrink.value) == pytest.approx((4.0, 1.0, 1.0))


def test_what_the_halves_differ_by_stays():
    """Every other eighth is a half: 2 and 6 ms rms."""
    closure = closure_of_jitter(jittered([0.002, 0.006] * 4, floor_s=0.001))
    assert (closure.before, closure.after) == pytest.approx((4.0, 5.0))
    assert closure.shrink.value == pytest.approx(-1.0 / 3.0)
    both = closure_of_jitter(jittered([0.002, 0.002, 0.006, 0.006] * 2, floor_s=0.001))
    assert both.after == pytest.approx(1.0)


def test_the_floor_of_a_jitter_is_never_that_of_perfect_times():
    assert closure_of_jitter(jittered([0.002] * 8)).before == pytest.approx(0.002 / LEAST_JITTER_S)


def counts_of(data, half):
    """Number of values (CELLS,) in each cell of a half."""
    problem = problem_of(data, half)
    return np.bincount(problem.flat.cells, problem.elements.valid, CELLS)


def test_cells_stand_out_that_have_enough_values():
    """Sixteen times the power of the floor in every force and torque of a short flight."""
    data = Data(FLOOR, [hover(7, louder=4.0, length_s=10.0)])
    both_halves = halves(data)
    gap = gap_of(data, both_halves, None)
    channel = np.arange(CELLS) % VIEW_STRIDE % len(COLUMN)
    for shown_by, cells in zip(both_halves[::-1], gap.cells, strict=True):
        counts = np.where(channel < TORQUE.stop, counts_of(data, shown_by), 0)
        assert (counts[counts > 0] < FEWEST_VALUES).any()
        np.testing.assert_array_equal(cells, counts >= FEWEST_VALUES)
    assert gap.closure.before == pytest.approx(4.0, rel=0.1) and gap.closure.shrink.value == 0.0


@pytest.mark.parametrize("power", [1.0, 1.0 + 0.75 * MARGIN])
def test_no_cell_stands_out_by_chance_or_by_less_than_the_margin(power):
    data = Data(FLOOR, [hover(7 + k, louder=np.sqrt(power)) for k in range(4)])
    gap = gap_of(data, halves(data), None)
    assert not np.any(gap.cells) and gap.closure.before == gap.closure.after == 1.0


def test_cells_count_in_which_the_effect_named_gains():
    """A tenth more power is within the margin, but noise of that strength gains where there are many values."""
    data = Data(FLOOR, [hover(7, louder=np.sqrt(1.1))])
    trial = trial_of(data)
    noise = cross_validated(trial, PricedVariant("imu_noise", tuple(terms("imu_noise")), 0.0), None)
    assert not np.any(gap_of(data, trial.halves, None).cells)
    gap = gap_of(data, trial.halves, noise)
    for half, cells in enumerate(gap.cells):
        other = trial.halves[1 - half]
        gains = cell_gains(data, other, noise.fits[1 - half].terms)
        np.testing.assert_array_equal(cells, (gains > CELL_GAIN) & (counts_of(data, other) >= FEWEST_VALUES))
    assert np.any(gap.cells)


def test_a_gap_that_one_half_alone_shows_is_not_measured_there():
    """Every other flight has four times the power: the others are judged in those cells, and are at their floor."""
    data = Data(FLOOR, [hover(7 + k, louder=1.0 if k % 2 else 2.0) for k in range(4)])
    gap = gap_of(data, halves(data), None)
    assert not gap.cells[0].any() and gap.cells[1].any()
    assert gap.closure.before == pytest.approx(1.0, abs=0.02)


def test_the_interval_is_that_of_the_power_of_white_noise():
    """A power ratio of 16 becomes 4, that of N real samples of white noise, which scatters by 4 sqrt(2 / N).

    So the shrink (4 - sqrt(4)) / 3 scatters by sqrt(2 / N) / 3, and its 90 % interval is 2 * 1.645 of these wide.
    """
    lift = np.zeros(CELLS, bool)
    lift[[cell_numbers(REPLAY_VIEW, band, LIFT) for band in range(1, len(BANDS_HZ) - 1)]] = True
    widths = []
    for seed in range(7, 13):
        data = Data(FLOOR, [hover(seed, louder=2.0)])
        both_halves = halves(data)
        n = int(sum(counts_of(data, half)[lift].sum() for half in both_halves))
        ratios_before = Gap((lift, lift), 0.0, np.full(n, 16.0), None)
        closure = closure_of(data, both_halves, Hypothesis("nothing", (), 0.0), ratios_before)
        assert (closure.before, closure.after) == pytest.approx((4.0, 2.0), rel=0.05)
        assert closure.shrink.low < closure.shrink.value < closure.shrink.high
        widths.append(closure.shrink.high - closure.shrink.low)
    assert np.mean(widths) == pytest.approx(2.0 * 1.645 * np.sqrt(2.0 / len(data.flights[0])) / 3.0, rel=0.2)


def biased(mps2):
    """The hypothesis that the accelerometer shows so much lift."""
    (bias,) = terms("imu_bias")[:1]
    fitted = SimpleNamespace(terms=(bias.fitted(bias.scaled({**bias.values, "acc_z": mps2})),))
    return Hypothesis("imu_bias", fitted.terms, 0.0, (fitted, fitted))


@pytest.mark.parametrize(("power_over_floor", "is_nearer"), [(0.0, False), (1.0, True), (1.8, True), (2.2, False)])
def test_less_than_the_floor_is_as_far_off_as_more(power_over_floor, is_nearer):
    """A flight with next to no noise is off by all of the floor; what a bias adds to its lowest band brings it nearer.

    A constant has its power in the lowest bin, and half as much in the next, which together may be as far over.
    """
    data = Data(FLOOR, [hover(7, louder=0.01)])
    both_halves, lift = halves(data), np.zeros(CELLS, bool)
    lift[cell_numbers(REPLAY_VIEW, 0, LIFT)] = True
    bins = np.flatnonzero(frequencies(AIR) < BANDS_HZ[1])
    floor = FLOOR.floor.power[AIR][bins, LIFT]
    power_of_1 = (1.0 / 1.5) / frequencies(AIR)[1] / floor[0] * 1.5  # of 1 m/s^2, in both bins, over the floor
    bias = biased(np.sqrt(power_over_floor * len(bins) / power_of_1))
    assert is_nearer_to_floor(data, both_halves, bias, SimpleNamespace(cells=(lift, lift))) == is_nearer


def test_the_right_effect_is_nearer_and_none_is_not():
    data = Data(FLOOR, [hover(7, (0.0, 0.0, 0.5))])
    both_halves, all_cells = halves(data), SimpleNamespace(cells=(np.ones(CELLS, bool),) * 2)
    assert is_nearer_to_floor(data, both_halves, biased(0.5), all_cells)
    assert not is_nearer_to_floor(data, both_halves, biased(-0.5), all_cells)
    assert not is_nearer_to_floor(data, both_halves, None, all_cells)
