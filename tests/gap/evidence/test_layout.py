"""Flattened values against loops over pieces, blocks, bins and channels."""

import numpy as np
import pytest

from airtouch.gap.evidence.cells import (
    CELLS,
    COMMAND_VIEW,
    REPLAY_VIEW,
    REST_VIEW,
    above_means,
    band_cells,
    cell_numbers,
    channel_cells,
    place_of,
)
from airtouch.gap.evidence.layout import Layout
from airtouch.gap.signals.channels import CHANNELS, COUNT
from airtouch.gap.signals.spectra import AIR, REST

BINS = {AIR: 4, REST: 3}
BLOCKS = {(0, AIR): 3, (0, REST): 2, (1, AIR): 2}


@pytest.fixture
def layout():
    """Two flights: two of three blocks and one of two at rest of the first, both of the second."""
    rng = np.random.default_rng(0)
    keep = {r: rng.random((n, COUNT)) < 0.4 for r, n in BINS.items()}
    pieces = ((0, AIR, np.array([True, False, True])), (0, REST, np.array([False, True])), (1, AIR, np.ones(2, bool)))
    return Layout(pieces, keep)


def by_hand(layout, value):
    """value(flight, state, block, bin, channel) of every value, in the order of loops."""
    return [value(i, r, block, b, c) for i, r, chosen in layout.pieces for block in np.flatnonzero(chosen)
            for b in range(BINS[r]) for c in range(COUNT) if layout.keep[r][b, c]]


def test_values_stand_in_the_order_of_pieces_blocks_bins_and_channels(layout):
    rng = np.random.default_rng(1)
    spectra = [{r: rng.normal(size=(n, BINS[r], COUNT)) for (i, r), n in BLOCKS.items() if i == flight}
               for flight in (0, 1)]
    expected = by_hand(layout, lambda i, r, block, b, c: spectra[i][r][block, b, c])
    assert layout.gather(spectra).tolist() == expected and sum(layout.sizes) == len(expected)


def test_what_a_bin_a_channel_or_a_flight_has_is_told_for_each_value(layout):
    table = {r: np.arange(n * COUNT).reshape(n, COUNT) for r, n in BINS.items()}
    assert layout.per_bin(table).tolist() == by_hand(layout, lambda i, r, block, b, c: table[r][b, c])
    assert layout.channels().tolist() == by_hand(layout, lambda i, r, block, b, c: c)
    assert layout.per_piece(lambda i, r: i + 10 * (r == REST)).tolist() == by_hand(
        layout, lambda i, r, block, b, c: i + 10 * (r == REST))


def test_blocks_in_the_air_are_numbered_through_all_flights(layout):
    first = [{AIR: np.array([0, 128, 256]), REST: np.array([5, 17])}, {AIR: np.array([64, 192])}]
    air = layout.air_blocks(first)
    number = {(0, 0): 0, (0, 2): 1, (1, 0): 2, (1, 1): 3}
    expected = by_hand(layout, lambda i, r, block, b, c: -1 if r == REST else number[i, block])
    assert air.block_of_value.tolist() == expected
    assert air.begin.tolist() == [0, 256, 64, 192] and air.flight.tolist() == [0, 0, 1, 1]


def test_nothing_is_laid_out_as_nothing():
    nothing = Layout((), {r: np.ones((n, COUNT), bool) for r, n in BINS.items()})
    assert len(nothing.gather([])) == len(nothing.channels()) == len(nothing.air_blocks([]).block_of_value) == 0


@pytest.mark.parametrize(("view", "band", "channel", "band_hz"), [
    (REPLAY_VIEW, 0, "force_z", (0.0, 0.6)), (REPLAY_VIEW, 5, "torque_x", (25.0, 50.0)),
    (REST_VIEW, 1, "rate_y", (0.6, 2.0)), (COMMAND_VIEW, 2, "command_roll", (0.6, 2.0))])
def test_place_of_a_cell_is_its_view_channel_and_band(view, band, channel, band_hz):
    number = cell_numbers(view, band, [c.name for c in CHANNELS].index(channel))
    assert place_of(number) == (view, channel, pytest.approx(band_hz))


def test_a_band_and_the_bands_above_the_means_are_told_by_the_number():
    force_z, rate_x = ([c.name for c in CHANNELS].index(name) for name in ("force_z", "rate_x"))
    for view in (REPLAY_VIEW, REST_VIEW):
        cells = [cell_numbers(view, band, channel) for band in (0, 1, 5) for channel in (force_z, rate_x)]
        assert band_cells()[cells].tolist() == [cell_numbers(view, band, 0) for band in (0, 0, 1, 1, 5, 5)]
        assert above_means()[cells].tolist() == [False, False, True, True, True, True]


def test_all_bands_of_a_channel_have_one_number_and_no_other_has_it():
    seen = {}
    for view in (REPLAY_VIEW, REST_VIEW, COMMAND_VIEW):
        for channel in range(COUNT):
            numbers = {channel_cells()[cell_numbers(view, band, channel)] for band in range(7)}
            assert len(numbers) == 1
            seen[view, channel] = numbers.pop()
    assert len(set(seen.values())) == 3 * COUNT and len(channel_cells()) == CELLS
