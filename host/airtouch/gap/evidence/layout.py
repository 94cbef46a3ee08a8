"""The order in which the values of some blocks of flights stand in one flat array."""

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.signals.channels import COUNT
from airtouch.gap.signals.spectra import AIR

Piece = tuple[int, str, np.ndarray]  #: number of a flight, state, and which of its blocks there (blocks,), bool


@dataclass(frozen=True)
class AirBlocks:
    """Blocks in the air, numbered from 0 through all flights.

    block_of_value (n,): number of the block of each flattened value, -1 for one on the ground; begin (b,): first sample
    of each block; flight (b,): number of its flight.
    """

    block_of_value: np.ndarray
    begin: np.ndarray
    flight: np.ndarray


class Layout:
    """The order of the values that count: piece by piece, block by block, bin by bin, channel by channel.

    pieces: blocks of flights; keep[state] (bins, COUNT): whether a bin of a channel counts, bool. The attribute
    `flights` is the set of the numbers of the flights that have a piece.
    """

    def __init__(self, pieces: Sequence[Piece], keep: Mapping[str, np.ndarray]) -> None:
        self.pieces, self.keep = pieces, keep
        self.flights = frozenset(i for i, _, _ in pieces)
        #: values of each piece
        self.sizes = [int(chosen.sum()) * int(keep[state].sum()) for _, state, chosen in pieces]

    def gather(self, by_flight: Sequence[Mapping[str, np.ndarray]]) -> np.ndarray:
        """Values (n,) that count of spectra (blocks, bins, COUNT), by flight and state."""
        return _joined((by_flight[i][state].take(indices)
                        for (i, state, _), indices in zip(self.pieces, self._indices, strict=True)), complex)

    def per_piece(self, value: Callable[[int, str], float]) -> np.ndarray:
        """What a function gives for the flight and state of each value, (n,)."""
        return _joined(np.full(size, value(i, state))
                       for (i, state, _), size in zip(self.pieces, self.sizes, strict=True))

    def per_bin(self, table: Mapping[str, np.ndarray]) -> np.ndarray:
        """The entry (n,) of a table (bins, COUNT) by state for each value; the same for all blocks."""
        return _joined(np.tile(table[state][self.keep[state]], int(chosen.sum())) for _, state, chosen in self.pieces)

    def channels(self) -> np.ndarray:
        """The channel (n,) of each value, its index in `channels.CHANNELS`."""
        table = {state: np.broadcast_to(np.arange(COUNT), keep.shape) for state, keep in self.keep.items()}
        return self.per_bin(table).astype(int)

    def air_blocks(self, first: Sequence[Mapping[str, np.ndarray]]) -> AirBlocks:
        """The blocks in the air. first: of every block the first sample, by flight and state."""
        block_of_value, begin, flight = [], [], []
        for i, state, chosen in self.pieces:
            numbers = np.full(int(chosen.sum()), -1)
            if state == AIR:
                numbers = len(begin) + np.arange(len(numbers))
                begin += list(first[i][AIR][chosen])
                flight += [i] * len(numbers)
            block_of_value.append(np.repeat(numbers, int(self.keep[state].sum())))
        return AirBlocks(_joined(block_of_value, int), np.array(begin, int), np.array(flight, int))

    @functools.cached_property
    def _indices(self) -> list[np.ndarray]:
        """Of each piece, the indices of its values in the flattened spectra of its flight."""
        return [np.flatnonzero(chosen[:, None, None] & self.keep[state]) for _, state, chosen in self.pieces]


def _joined(arrays: Iterable[np.ndarray], kind: type = float) -> np.ndarray:
    """Arrays one after another; where there is none an empty one of type `kind`."""
    arrays = list(arrays)
    return np.concatenate(arrays) if arrays else np.zeros(0, kind)
