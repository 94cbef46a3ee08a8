"""Some blocks of flights under hypotheses: the residual that these leave, the power that they add, its likelihood."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence import random_effects
from airtouch.gap.evidence.data import Data, residual_spectra
from airtouch.gap.evidence.flattened import Elements, Flattened, Offset, flattened
from airtouch.gap.evidence.layout import Piece
from airtouch.gap.evidence.likelihood import Likelihood
from airtouch.gap.evidence.torque_power import beside_edges, extra_torque_power
from airtouch.gap.signals.spectra import AIR, REST
from airtouch.gap.signatures.candidates import mean_of, random_of
from airtouch.gap.signatures.term import Term
from airtouch.simulation.effects import Active

TWO_FOLDS = ((0, 1), (1, 0))  #: cross-validation: the number of the half that is fitted, and of the half judged


@dataclass(frozen=True)
class BlockSet:
    """A set of blocks of flights, for fitting or judging.

    pieces: of each flight and state, whether each of its blocks is in the set (`layout.Piece`).
    """

    pieces: tuple[Piece, ...]

    @property
    def key(self) -> Hashable:
        """Equal for two sets of the same blocks."""
        return tuple((flight, state, chosen.tobytes()) for flight, state, chosen in self.pieces)


class LoopChange(NamedTuple):
    """What effects of the control loop change.

    extra_power (n,): what they add to the floor's, unit^2/Hz; cost: nats that the commands' floor costs.
    """

    extra_power: np.ndarray
    cost: float


class Modelled(NamedTuple):
    """Some blocks under a hypothesis.

    residual (n,): under its mean effects, offsets not yet subtracted, unit/sqrt(Hz); extra_power (n,): what its effects
    add to the floor's, unit^2/Hz; cost: nats that the commands' floor costs.
    """

    residual: np.ndarray
    extra_power: np.ndarray
    cost: float


@dataclass(frozen=True, eq=False)
class Problem:
    """Blocks of the flights of `data` as n flattened values, under hypotheses. flat: what is known before any."""

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

    def residual(self, active: Sequence[Active]) -> np.ndarray:
        """The residual (n,) with effects in the model, unit/sqrt(Hz); 0 where it is not valid."""
        flat, replayed = self.flat, beside_edges(active)
        of_replay = flat.elements.residual[:flat.replay_count]
        if replayed:
            of_replay = flat.layout.gather(residual_spectra(self.data, replayed, flat.layout.flights))
        of_commands = flat.commands.values_without([a for a in active if not a.gate])
        return np.where(flat.elements.valid, flat.joined(of_replay, of_commands), 0.0)

    def modelled(self, terms: Sequence[Term], uncertain_floor: bool = False) -> Modelled:
        """The blocks under a hypothesis.

        uncertain_floor: the commands' floor is as uncertain as under random effects, though there are none.
        """
        random = random_of(terms)
        mean = [t.active() for t in mean_of(terms)]
        of_loop = self.loop_change([*mean, *(t.active() for t in random)], uncertain_floor or bool(random))
        return Modelled(self.residual(mean), self.random_power(random) + of_loop.extra_power, of_loop.cost)

    def loop_change(self, active: Sequence[Active], uncertain_floor: bool = False) -> LoopChange:
        """What effects of the control loop add to the floors of torque and commands.

        uncertain_floor: as in `modelled`.
        """
        commands = self.flat.commands
        expected_power, cost = commands.power([a for a in active if not a.gate], uncertain_floor)
        of_commands = expected_power - commands.elements.floor
        return LoopChange(np.concatenate([self.extra_torque_power(active), of_commands]), cost)

    def extra_torque_power(self, active: Sequence[Active]) -> np.ndarray:
        """Extra power (replay,) of the torque under effects of the loop, with which that of `loop_change` begins."""
        return extra_torque_power(self.data, self.flat, active)

    def random_power(self, terms: Sequence[Term]) -> np.ndarray:
        """Extra power (n,) of random effects, unit^2/Hz."""
        total = np.zeros(len(self.elements.residual))
        for term in terms:
            total += self.flat.joined(self.flat.layout.gather(random_effects.extra_power(self.data, term)).real)
        return total


def whole_of(data: Data, flights: Sequence[int] | None = None) -> BlockSet:
    """Every block of every flight, or of the flights of these numbers."""
    numbers = range(len(data.flights)) if flights is None else flights
    counts = [(i, state, len(data.block_starts[i][state])) for i in numbers for state in (AIR, REST)]
    return BlockSet(tuple((i, state, np.ones(count, bool)) for i, state, count in counts if count))


def problem_of(data: Data, blocks: BlockSet) -> Problem:
    """The problem of some blocks. These are flattened once and cached by the data, to which they do not refer."""
    return Problem(data, data.workspace.cached("flattened", blocks.key, lambda: flattened(data, blocks.pieces)))
