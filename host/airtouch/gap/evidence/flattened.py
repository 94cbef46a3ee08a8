"""Blocks of flights flattened to one array of values, and what is known of each before any hypothesis."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.cells import COMMAND_FIRST_BAND, COMMAND_VIEW, REPLAY_VIEW, REST_VIEW, cell_numbers
from airtouch.gap.evidence.data import Data, Spectra
from airtouch.gap.evidence.layout import AirBlocks, Layout, Piece
from airtouch.gap.evidence.likelihood import REPLAY_FREEDOM, Likelihood, tail_scale
from airtouch.gap.evidence.sensing import changed_echo_nats
from airtouch.gap.flights.blocks import BANDS_HZ
from airtouch.gap.signals.channels import COMMAND, COUNT, TORQUE
from airtouch.gap.signals.command_view import CommandElements, CommandView, view_of
from airtouch.gap.signals.response import FIRST_BIN
from airtouch.gap.signals.spectra import AIR, REST, frequencies, judged_bins, short_time_spectra
from airtouch.gap.workspace import Workspace

OFFSETS = 6  #: channels (force, torque) whose mean may differ from flight to flight
#: degrees of freedom that each block of nominal flights adds to those of the floor; chosen. A larger number trusts a
#: floor of few blocks more than is right, so that what is only an error of the floor counts as evidence
FREEDOM_OF_BLOCK = 3.0
LEAST_FREEDOM = 2.0  #: degrees of freedom of a floor of no block; chosen. A larger number errs as FREEDOM_OF_BLOCK does


class Offset(NamedTuple):
    """An offset of one channel of one flight, of which each nominal flight has another.

    indices (m,): of the values that it changes, ascending; column, complex (m,): what an offset of 1 adds to the
    residual there, 1/sqrt(Hz); prior_std: standard deviation of the offset's prior, in the channel's unit.
    """

    indices: np.ndarray
    column: np.ndarray
    prior_std: float

    def at(self, indices: np.ndarray) -> np.ndarray:
        """What an offset of 1 adds, complex (k,), to the values at k indices, all different; 0 where it adds none."""
        out = np.zeros(len(indices), complex)
        _, there, here = np.intersect1d(indices, self.indices, assume_unique=True, return_indices=True)
        out[there] = self.column[here]
        return out


@dataclass(frozen=True, eq=False)
class Elements:
    """What is known of flattened values (n,) before any hypothesis.

    residual: complex, without effects, unit/sqrt(Hz), 0 where it is not valid; floor_power: expected of it, what lost
    rows add included, unit^2/Hz; valid: bool, False where the log lacks what the value is made of; channel: its index
    in `channels.CHANNELS`; flight: its index in `Data.flights`; freedom, tail_scale: degrees of freedom and scale of
    the likelihood's tails.
    """

    residual: np.ndarray
    floor_power: np.ndarray
    valid: np.ndarray
    channel: np.ndarray
    flight: np.ndarray
    freedom: np.ndarray
    tail_scale: np.ndarray

    def followed_by(self, other: "Elements") -> "Elements":
        """These and others after them."""
        return Elements(*(np.concatenate([getattr(self, f.name), getattr(other, f.name)]) for f in fields(self)))


@dataclass(frozen=True, eq=False)
class Flattened:
    """Some blocks of flights as values (n,): first those of the replay view, then those of the commands.

    layout: of the replay view's values; commands: the command view; elements: of all values; noise (replay,): floor
    power of the replay view without what lost rows add; offsets: those between flights, of which no two change the same
    value; air: the blocks in the air of the replay view; workspace: what is cached of these blocks.
    """

    layout: Layout
    commands: CommandView
    elements: Elements
    noise: np.ndarray
    offsets: Sequence[Offset]
    air: AirBlocks
    workspace: Workspace = field(default_factory=Workspace, init=False, repr=False)

    @property
    def replay_count(self) -> int:
        """How many values are those of the replay view."""
        return len(self.noise)

    @functools.cached_property
    def likelihood(self) -> Likelihood:
        """The likelihood of all values."""
        e = self.elements
        return Likelihood(e.floor_power, e.freedom, e.tail_scale, e.valid)

    @functools.cached_property
    def is_torque(self) -> np.ndarray:
        """Whether a value of the replay view is one of the torque, bool (replay,)."""
        channel = self.elements.channel[:self.replay_count]
        return (channel >= TORQUE.start) & (channel < TORQUE.stop)

    @functools.cached_property
    def cells(self) -> np.ndarray:
        """Number (n,) of the cell of each value (see the module `cells`)."""
        bands = {state: np.digitize(frequencies(state), BANDS_HZ)[:, None] - 1 for state in (AIR, REST)}
        replay = self.layout.per_bin({state: cell_numbers(view, bands[state], np.arange(COUNT))
                                      for state, view in ((AIR, REPLAY_VIEW), (REST, REST_VIEW))})
        elements = self.commands.elements
        command_bands = np.digitize(elements.frequency, BANDS_HZ) - 1 + COMMAND_FIRST_BAND
        commands = cell_numbers(COMMAND_VIEW, command_bands, elements.channel) if len(self.commands) else np.zeros(0)
        return np.concatenate([replay, commands]).astype(int)

    def joined(self, replay: np.ndarray, commands: np.ndarray | float = 0.0) -> np.ndarray:
        """Values (replay,) of the replay view, followed by one value, or one each, for those of the commands."""
        return np.concatenate([replay, np.broadcast_to(commands, len(self.commands))])


def flattened(data: Data, pieces: Sequence[Piece]) -> Flattened:
    """Some blocks of the flights of `data`, flattened."""
    layout = Layout(pieces, _counted(data))
    commands = view_of(data.study.loop, data.flights, data.block_starts, pieces)
    noise = layout.gather([{state: data.study.floor.of_blocks(f, b[state], state) for state in b}
                           for f, b in zip(data.flights, data.block_starts, strict=True)]).real
    elements = _of_replay(data, layout, noise).followed_by(_of_commands(commands.elements))
    return Flattened(layout, commands, elements, noise, _offsets(data, layout), layout.air_blocks(data.block_starts))


def _counted(data: Data) -> dict[str, np.ndarray]:
    """Whether each bin of each channel (bins, COUNT) of the replay view counts, by state.

    Torque counts in its means alone where `Data.means_only`. If the gyro's noise has another echo in the commands
    than in nominal flights, and no model says how, it does not count where that noise may make it.
    """
    keep = {state: judged_bins(state) for state in (AIR, REST)}
    for table in keep.values():
        table[:, COMMAND] = False  # the command view judges them
    response = data.study.response
    if response is None:
        keep[AIR][FIRST_BIN:, TORQUE] = False
    elif changed_echo_nats(data) and not data.study.same_models:
        keep[AIR][:, TORQUE] &= ~response.may_be_gyro
    return keep


def _of_replay(data: Data, layout: Layout, noise: np.ndarray) -> Elements:
    """The values of the replay view. noise (replay,): see `Flattened`."""
    residual, counts = layout.gather(data.residual), data.study.floor.block_counts
    valid = np.isfinite(residual)
    floor_power = noise + layout.gather([{AIR: lost, REST: np.zeros(of_flight[REST].shape)}
                                         for lost, of_flight in zip(data.bridging, data.residual, strict=True)]).real
    freedom = layout.per_piece(
        lambda _, state: np.clip(FREEDOM_OF_BLOCK * counts[state], LEAST_FREEDOM, REPLAY_FREEDOM))
    return Elements(np.where(valid, residual, 0.0), np.where(valid, floor_power, 1.0), valid, layout.channels(),
                    layout.per_piece(lambda flight, _: flight).astype(int), freedom, tail_scale(freedom))


def _of_commands(commands: CommandElements) -> Elements:
    """The values of the command view, whose floor has its tails in it."""
    return Elements(commands.values, commands.floor, np.ones(len(commands.values), bool), commands.channel.astype(int),
                    commands.flight.astype(int), commands.freedom, commands.freedom)


def _offsets(data: Data, layout: Layout) -> list[Offset]:
    """One for each of OFFSETS channels of each flight whose mean differs between nominal flights."""
    prior_std, out = data.study.offset, []
    for flight in range(len(data.flights)):
        for channel in np.flatnonzero(prior_std[:OFFSETS] > 0.0):
            column = layout.gather(_offset_of_one(data, flight, int(channel)))
            indices = np.flatnonzero(column)
            out.append(Offset(indices, column[indices], float(prior_std[channel])))
    return out


def _offset_of_one(data: Data, flight: int, channel: int) -> list[Spectra]:
    """Spectra by flight and state of a signal that is 1 in one channel of one flight in the air, else 0."""
    ones = np.zeros((len(data.flights[flight]), COUNT))
    ones[~data.flights[flight].on_ground, channel] = 1.0
    return [{state: short_time_spectra(ones, begin, state) if j == flight else np.zeros_like(data.residual[j][state])
             for state, begin in first.items()} for j, first in enumerate(data.block_starts)]
