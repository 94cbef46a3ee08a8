"""What hypotheses make of some blocks of flights: the gap that they leave, the power that they add, its likelihood."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence import random_effects
from airtouch.gap.evidence.data import Data, gap_spectra
from airtouch.gap.evidence.flattened import Elements, Flattened, Offset, flattened
from airtouch.gap.evidence.layout import Piece
from airtouch.gap.evidence.likelihood import Likelihood
from airtouch.gap.evidence.torque_power import beside_edges, torque_power
from airtouch.gap.signals.spectra import AIR, REST
from airtouch.gap.signatures.candidates import mean_of, random_of
from airtouch.gap.signatures.term import Term
from airtouch.simulation.effects import Active

TWO_FOLDS = ((0, 1), (1, 0))  #: the half that is fitted, the half that is judged


@dataclass(frozen=True)
class BlockSet:
    """Which blocks of which flights: (flight, state, chosen bool array), for fitting or judging."""

    pieces: tuple[Piece, ...]

    @property
    def key(self) -> Hashable:
        """Equal for two parts of the same blocks."""
        return tuple((flight, state, chosen.tobytes()) for flight, state, chosen in self.pieces)


class LoopChange(NamedTuple):
    """What effects of the loop change.

    power (n,): what they add to that expected of the gap, unit^2/Hz; cost: nats that the commands' floor costs.
    """

    power: np.ndarray
    cost: float


class Modelled(NamedTuple):
    """A hypothesis on some blocks.

    gap (n,): what its mean effects leave, unit/sqrt(Hz); extra_power (n,): what its effects add to the power expected
    of the gap, unit^2/Hz; cost: nats that the commands' floor costs.
    """

    gap: np.ndarray
    extra_power: np.ndarray
    cost: float


@dataclass(frozen=True, eq=False)
class Problem:
    """Blocks of the flights of `data` as flattened values (n,), under hypotheses. flat: what is known before any."""

    data: Data
    flat: Flattened

    @property
    def elements(self) -> Elements:
        """What is known of the values."""
        return self.flat.elements

    @property
    def offsets(self) -> Sequence[Offset]:
        """The offsets between flights."""
        return self.flat.offsets

    @property
    def likelihood(self) -> Likelihood:
        """The likelihood of the values."""
        return self.flat.likelihood

    def values(self, active: Sequence[Active]) -> np.ndarray:
        """The gap (n,) with effects in the model."""
        flat, replayed = self.flat, beside_edges(active)
        replay_values = flat.elements.base[:flat.replay_count]
        if replayed:
            replay_values = flat.layout.gather(gap_spectra(self.data, replayed, flat.layout.flights))
        command_values = flat.commands.values_without([a for a in active if not a.gate])
        return np.where(flat.elements.valid, flat.joined(replay_values, command_values), 0.0)

    def modelled(self, terms: Sequence[Term], uncertain_floor: bool = False) -> Modelled:
        """What a hypothesis makes of the blocks.

        uncertain_floor: the commands' floor is as uncertain as under random effects, though there are none.
        """
        random = random_of(terms)
        mean = [t.active() for t in mean_of(terms)]
        of_loop = self.loop_power([*mean, *(t.active() for t in random)], uncertain_floor or bool(random))
        return Modelled(self.values(mean), self.random_power(random) + of_loop.power, of_loop.cost)

    def loop_power(self, active: Sequence[Active], uncertain_floor: bool = False) -> LoopChange:
        """What effects of the loop add to the floors of torque and commands.

        uncertain_floor: as in `modelled`.
        """
        commands = self.flat.commands
        power, cost = commands.power([a for a in active if not a.gate], uncertain_floor)
        return LoopChange(np.concatenate([self.torque_power(active), power - commands.elements.floor]), cost)

    def torque_power(self, active: Sequence[Active]) -> np.ndarray:
        """Power (replay,) that effects of the loop add to the floor of the torque, the first part of `loop_power`."""
        return torque_power(self.data, self.flat, active)

    def random_power(self, terms: Sequence[Term]) -> np.ndarray:
        """Power (n,) that random effects add."""
        total = np.zeros(len(self.elements.base))
        for term in terms:
            total += self.flat.joined(self.flat.layout.gather(random_effects.power(self.data, term)).real)
        return total


def whole_of(data: Data, flights: Sequence[int] | None = None) -> BlockSet:
    """Every block of every flight, or of the flights of these numbers."""
    numbers = range(len(data.flights)) if flights is None else flights
    return BlockSet(tuple((i, state, np.ones(len(data.first[i][state]), bool)) for i in numbers for state in (AIR, REST)
                          if len(data.first[i][state])))


def problem_of(data: Data, part: BlockSet) -> Problem:
    """The problem of a part. Its blocks are flattened once and kept by the data, which they do not refer to."""
    return Problem(data, data.workspace.cached("flattened", part.key, lambda: flattened(data, part.pieces)))
