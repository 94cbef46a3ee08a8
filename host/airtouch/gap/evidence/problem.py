"""Blocks of flights flattened to one array, and what hypotheses make of them: gap, expected power, likelihood."""

import functools
import weakref
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence import random_effects
from airtouch.gap.evidence.cells import COMMAND_VIEW, REPLAY_VIEW, REST_VIEW, cell_numbers
from airtouch.gap.evidence.data import Data, gap_spectra
from airtouch.gap.evidence.layout import Layout, Piece
from airtouch.gap.evidence.likelihood import REPLAY_FREEDOM, Likelihood, tail
from airtouch.gap.evidence.torque_power import TorquePower, beside_edges
from airtouch.gap.flights.blocks import BANDS_HZ
from airtouch.gap.signals.channels import COMMAND, COUNT, TORQUE
from airtouch.gap.signals.command_view import CommandElements, view_of
from airtouch.gap.signals.response import FIRST_BIN
from airtouch.gap.signals.spectra import AIR, REST, frequencies, judged_bins, short_time_spectra
from airtouch.gap.signatures.candidates import mean_of, random_of
from airtouch.gap.signatures.term import Term
from airtouch.gap.workspace import Workspace
from airtouch.simulation.effects import Active

TWO_FOLDS = ((0, 1), (1, 0))  #: the half that is fitted, the half that is judged
OFFSETS = 6  #: channels (force, torque) whose mean may differ from flight to flight
#: independent values in a block for the floor's degrees of freedom, and the least that these are; chosen
FREEDOM_OF_BLOCK, LEAST_FREEDOM = 3.0, 2.0


@dataclass(frozen=True)
class BlockSet:
    """Which blocks of which flights: (flight, state, chosen bool array), for fitting or judging."""

    pieces: tuple[Piece, ...]

    @property
    def key(self) -> Hashable:
        """Equal for two parts of the same blocks."""
        return tuple((flight, state, chosen.tobytes()) for flight, state, chosen in self.pieces)


class Offset(NamedTuple):
    """What a unit offset of one channel of one flight adds: at which places, how much there, prior's deviation."""

    places: np.ndarray
    column: np.ndarray
    spread: float


@dataclass(frozen=True)
class Elements:
    """What is known of flattened values (n,) before any hypothesis.

    base: the gap without effects, unit/sqrt(Hz), 0 where unknown; power: its expected power, unit^2/Hz; known: whether
    a value counts; channel, flight: their numbers; freedom, tail: degrees of freedom and scale of the likelihood's
    tails.
    """

    base: np.ndarray
    power: np.ndarray
    known: np.ndarray
    channel: np.ndarray
    flight: np.ndarray
    freedom: np.ndarray
    tail: np.ndarray

    def followed_by(self, other: "Elements") -> "Elements":
        """These and others after them."""
        return Elements(*(np.concatenate([getattr(self, f.name), getattr(other, f.name)]) for f in fields(self)))


class Problem:
    """A part of flights as flattened values (n,): `replay_count` of the replay view, then those of the commands.

    Arrays over all values are those of `Elements`. air: the blocks in the air of the replay view.
    """

    def __init__(self, data: Data, part: BlockSet) -> None:
        # the data keeps its problems: no cycle, no garbage to wait for
        self.data, self.workspace = weakref.proxy(data), Workspace()
        self.layout = Layout(part.pieces, _counted(data.means_only))
        self.commands = view_of(data.study.loop, data.flights, data.first, part.pieces)
        noise = self.layout.gather([{r: data.study.floor.of_blocks(f, b[r], r) for r in b}
                                    for f, b in zip(data.flights, data.first, strict=True)]).real
        replay = _of_replay(data, self.layout, noise)
        self.replay_count = len(replay.base)
        torque = (replay.channel >= TORQUE.start) & (replay.channel < TORQUE.stop)
        self.torque_power = TorquePower(self.data, self.layout, replay.base, replay.known, torque, noise)
        self.air = self.layout.air_blocks(data.first)
        values = replay.followed_by(_of_commands(self.commands.elements))
        self.base, self.power, self.known = values.base, values.power, values.known
        self.channel, self.flight = values.channel.astype(int), values.flight.astype(int)
        self.freedom, self.tail = values.freedom, values.tail
        self.likelihood = Likelihood(self.power, self.freedom, self.tail, self.known)

    @functools.cached_property
    def cells(self) -> np.ndarray:
        """Number (n,) of the cell of each value (`cells`)."""
        bands = {r: np.digitize(frequencies(r), BANDS_HZ)[:, None] - 1 for r in (AIR, REST)}
        replay = self.layout.per_bin({r: cell_numbers(view, bands[r], np.arange(COUNT))
                                      for r, view in ((AIR, REPLAY_VIEW), (REST, REST_VIEW))})
        of_commands = self.commands.elements
        commands = cell_numbers(COMMAND_VIEW, np.digitize(of_commands.frequency, BANDS_HZ), of_commands.channel) \
            if len(self.commands) else np.zeros(0)
        return np.concatenate([replay, commands]).astype(int)

    def values(self, active: Sequence[Active]) -> np.ndarray:
        """The gap (n,) with effects in the model."""
        replayed = beside_edges(active)
        replay_values = self.base[:self.replay_count]
        if replayed:
            replay_values = self.layout.gather(gap_spectra(self.data, replayed, self.layout.flights))
        command_values = self.commands.values_without([a for a in active if not a.gate])
        return np.where(self.known, self.joined(replay_values, command_values), 0.0)

    def joined(self, replay: np.ndarray, commands: np.ndarray | float = 0.0) -> np.ndarray:
        """Values (replay,) of the replay view, followed by one value, or one each, for those of the commands."""
        return np.concatenate([replay, np.broadcast_to(commands, len(self.commands))])

    def modelled(self, terms: Sequence[Term], wide: bool = False) -> tuple[np.ndarray, np.ndarray, float]:
        """A hypothesis: the gap (n,) with its mean effects, the power (n,) that it adds, and nats that its floor costs.

        wide: the commands' floor is as uncertain as under random effects, though there are none.
        """
        random = random_of(terms)
        mean = [t.active() for t in mean_of(terms)]
        command_power, cost = self.loop_power([*mean, *(t.active() for t in random)], wide or bool(random))
        return self.values(mean), self.random_power(random) + command_power, cost

    def loop_power(self, active: Sequence[Active], wide: bool = False) -> tuple[np.ndarray, float]:
        """Power (n,) that effects of the loop add to the floors of torque and commands, and nats that this costs.

        wide: as in `modelled`.
        """
        power, cost = self.commands.power([a for a in active if not a.gate], wide)
        return np.concatenate([self.torque_power.added_by(active), power - self.commands.elements.floor]), cost

    def random_power(self, terms: Sequence[Term]) -> np.ndarray:
        """Power (n,) that random effects add."""
        total = np.zeros(len(self.base))
        for term in terms:
            total += self.joined(self.layout.gather(random_effects.power(self.data, term)).real)
        return total

    @functools.cached_property
    def unit_offsets(self) -> list[tuple[np.ndarray, float]]:
        """What a unit offset of one channel of one flight adds to the gap (n,), and its prior's standard deviation.

        One for each of OFFSETS channels of each flight whose mean differs between nominal flights.
        """
        spread = self.data.study.offset
        return [(self.joined(self.layout.gather(self._offset(i, c))), float(spread[c]))
                for i in range(len(self.data.flights)) for c in range(OFFSETS) if spread[c] > 0.0]

    def _offset(self, flight: int, channel: int) -> list[dict[str, np.ndarray]]:
        """Spectra by flight and state of 1 in one channel of one flight, in the air."""
        ones = np.zeros((len(self.data.flights[flight]), COUNT))
        ones[~self.data.flights[flight].on_ground, channel] = 1.0
        return [{r: short_time_spectra(ones, begin, r) if j == flight else np.zeros_like(self.data.base[j][r])
                 for r, begin in first.items()} for j, first in enumerate(self.data.first)]

    @functools.cached_property
    def offsets(self) -> list[Offset]:
        """`unit_offsets` without zeros. No two have a place in common."""
        places = [np.flatnonzero(column) for column, _ in self.unit_offsets]
        return [Offset(here, column[here], spread)
                for here, (column, spread) in zip(places, self.unit_offsets, strict=True)]


def _counted(means_only: bool) -> dict[str, np.ndarray]:
    """Bins and channels (bins, COUNT) of the replay view that count, by state. means_only: `Data.means_only`."""
    keep = {r: judged_bins(r) for r in (AIR, REST)}
    for table in keep.values():
        table[:, COMMAND] = False  # the command view judges them
    if means_only:
        keep[AIR][FIRST_BIN:, TORQUE] = False
    return keep


def _of_replay(data: Data, layout: Layout, noise: np.ndarray) -> Elements:
    """The values of the replay view. noise (replay,): power of the floor, without what lost rows add."""
    base, counts = layout.gather(data.base), data.study.floor.block_counts
    known = np.isfinite(base)
    power = noise + layout.gather([{AIR: lost, REST: np.zeros(spectra_of[REST].shape)}
                                   for lost, spectra_of in zip(data.bridging, data.base, strict=True)]).real
    freedom = layout.per_piece(
        lambda _, state: np.clip(FREEDOM_OF_BLOCK * counts[state], LEAST_FREEDOM, REPLAY_FREEDOM))
    return Elements(np.where(known, base, 0.0), np.where(known, power, 1.0), known, layout.channels(),
                    layout.per_piece(lambda flight, _: flight), freedom, tail(freedom))


def _of_commands(commands: CommandElements) -> Elements:
    """The values of the command view, whose floor has its tails in it."""
    return Elements(commands.values, commands.floor, np.ones(len(commands.values), bool), commands.channel,
                    commands.flight, commands.freedom, commands.freedom)


def whole_of(data: Data, flights: Sequence[int] | None = None) -> BlockSet:
    """Every block of every flight, or of the flights of these numbers."""
    numbers = range(len(data.flights)) if flights is None else flights
    return BlockSet(tuple((i, r, np.ones(len(data.first[i][r]), bool)) for i in numbers for r in (AIR, REST)
                          if len(data.first[i][r])))


def problem_of(data: Data, part: BlockSet) -> Problem:
    """The flattened blocks of a part, made once."""
    return data.workspace.cached("problem", part.key, lambda: Problem(data, part))
