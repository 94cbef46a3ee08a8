"""Flattened values against loops over pieces, blocks, bins and channels."""

import numpy as np
import pytest

from airtouch.gap.evidence.layout import Layout
from airtouch.gap.signals.channels import COUNT
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
