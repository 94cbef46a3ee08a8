"""The command view: a flight's logged commands held against those of nominal flights, and how likely they are.

All compared values stand one after another (elements,). First the spectra (blocks, bins, AXES) of the commands of each
flight: the power e of a value against p = floor x ratio x correction, (bins, AXES) each: of nominal flights, of the
hypothesis over none (`ClosedLoop.ratio`), of this flight (`command_floor_correction`). Then the whitened responses at
edges (edges, COUNT): each value less what effects add to it, of power 1. The log likelihood of the spectra is the sum
of `command_spectra.log_likelihood` over flights, less the corrections' cost; each block is counted half, as half
overlapping blocks hold every sample twice.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from airtouch.gap.edges import edge_effects, edge_response
from airtouch.gap.flights.flight import Flight
from airtouch.gap.loop.closed_loop import ClosedLoop
from airtouch.gap.loop.command_spectra import COMMAND_FREEDOM, COMMAND_LENGTH, command_frequencies, log_likelihood
from airtouch.gap.loop.controller import AXES
from airtouch.gap.signals.channels import COMMAND
from airtouch.gap.signals.command_floor_correction import correction_of, smooth_shapes
from airtouch.gap.signals.spectra import AIR, LENGTH, OVERLAP_WEIGHT
from airtouch.gap.signatures.signature import signature_of
from airtouch.gap.workspace import Workspace
from airtouch.logs.edges import Edge
from airtouch.simulation.effects import Active

EDGE_FREEDOM = 6.0  #: degrees of freedom of the Student-like tails of responses at edges; chosen
KEPT_POWERS = 300  #: hypotheses whose expected power is cached; chosen
SMALL = 1e-3  #: change of a scaled parameter, in natural steps, over which the likelihood's slope is taken; chosen
#: channel of each number of a response at an edge: thrust by the thrust command, speed by pitch, height by thrust
EDGE_CHANNELS = np.repeat([COMMAND.start, COMMAND.start + AXES.index("pitch"), COMMAND.start],
                          [n for _, n in edge_response.BINS])


class CommandElements(NamedTuple):
    """Values (n,) of some blocks or edges, complex, one after another, and what belongs to each of them.

    floor: power in nominal flights; channel: its number in `channels.CHANNELS`; frequency: Hz; flight: its number;
    freedom: degrees of freedom of its Student-like tails.
    """

    values: np.ndarray
    floor: np.ndarray
    channel: np.ndarray
    frequency: np.ndarray
    flight: np.ndarray
    freedom: np.ndarray


class CommandPower(NamedTuple):
    """Expected power (elements,) of the commands, and what the correction of their floor costs, nats."""

    power: np.ndarray
    cost: float


class LikelihoodSlopes(NamedTuple):
    """Gradient (k,) of a log likelihood by k scaled parameters, and its information (k, k), which is never negative."""

    gradient: np.ndarray
    information: np.ndarray


@dataclass(frozen=True, eq=False)
class CommandView:
    """The commands of some flights: values with their floor, and their expected power under a hypothesis.

    loop: of nominal flights, against which the commands are held; None without, and then the view has no element.
    elements: first those of the spectra, flight by flight, then those of the responses at edges; powers: squares of the
    spectra (blocks, bins, AXES) of each flight that has blocks; edges: each with its flight.
    """

    loop: ClosedLoop | None
    elements: CommandElements
    powers: Sequence[np.ndarray] = ()
    edges: Sequence[tuple[Flight, Edge]] = ()
    workspace: Workspace = field(default_factory=Workspace)

    def __len__(self) -> int:
        return len(self.elements.values)

    def values_without(self, active: Sequence[Active]) -> np.ndarray:
        """Values (elements,) less what effects add to the responses at edges; the spectra stay as they are."""
        floor = None if self.loop is None else self.loop.edges
        if floor is None or not self.edges or not any(signature_of(a.effect).at_edges for a in active):
            return self.elements.values
        out = self.elements.values.copy()
        at = len(out) - len(self.edges) * edge_response.COUNT
        for flight, e in self.edges:
            out[at:at + edge_response.COUNT] -= edge_effects.added_response(floor, flight, e, active)
            at += edge_response.COUNT
        return out

    def power(self, active: Sequence[Active], uncertain_floor: bool = False) -> CommandPower:
        """The expected power under effects, the correction of the floor fitted anew.

        uncertain_floor: it is as uncertain as random effects make it (`command_floor_correction.UNCERTAIN_FACTOR`).
        """
        loop = self.loop
        if loop is None or not self.powers:
            return CommandPower(self.elements.floor, 0.0)
        ratio = loop.ratio(active)
        return self.workspace.cached("power", (ratio.tobytes(), uncertain_floor),
                                     lambda: self._expected(loop.floor, ratio, uncertain_floor), KEPT_POWERS)

    def _expected(self, floor: np.ndarray, ratio: np.ndarray, uncertain_floor: bool) -> CommandPower:
        """`power` where effects multiply the floor of the commands by a ratio, (bins, AXES) each."""
        powers, cost = [], 0.0
        for s in self.powers:
            correction = correction_of(s, floor, ratio, uncertain_floor)
            cost += correction.cost
            powers.append(np.broadcast_to(correction.power, s.shape).ravel())
        powers.append(np.ones(len(self.edges) * edge_response.COUNT))
        return CommandPower(np.concatenate(powers), cost)

    def rise(self, before: Sequence[Active], after: Sequence[Active]) -> np.ndarray:
        """Rise (bins, AXES) of the logarithm of the expected power between hypotheses; (0, AXES) without spectra."""
        if self.loop is None or not self.powers:
            return np.zeros((0, len(AXES)))
        return np.log(self.loop.ratio(after) / self.loop.ratio(before))

    def slopes(self, active: Sequence[Active], rise: np.ndarray, uncertain_floor: bool = False,
               ) -> LikelihoodSlopes:
        """Slopes of the spectra's log likelihood by k scaled parameters.

        Responses at edges are not in it: their power is 1 under every hypothesis.

        rise (k, bins, AXES): of the logarithm of the power per scaled parameter; active, uncertain_floor: see `power`.
        """
        k = len(rise)
        gradient, information = np.zeros(k), np.zeros((k, k))
        if self.loop is None or not rise.any():
            return LikelihoodSlopes(gradient, information)
        floor, ratio = self.loop.floor, self.loop.ratio(active)
        for i in np.flatnonzero(rise.any(axis=(1, 2))):
            up, down = (self._log_likelihood(floor, ratio * np.exp(sign * SMALL * rise[i]), uncertain_floor)
                        for sign in (1.0, -1.0))
            gradient[i] = (up - down) / (2.0 * SMALL)
        for s in self.powers:
            correction = correction_of(s, floor, ratio, uncertain_floor)
            for axis in range(len(AXES)):  # what the shapes can take up tells nothing
                slope = rise[:, :, axis]
                cross = correction.weight * slope @ smooth_shapes().T
                information += correction.weight * slope @ slope.T - cross @ correction.covariance @ cross.T
        return LikelihoodSlopes(gradient, information)

    def _log_likelihood(self, floor: np.ndarray, ratio: np.ndarray, uncertain_floor: bool) -> float:
        """Log likelihood of the spectra, less the costs of the floor's correction.

        floor, ratio (bins, AXES): power in nominal flights, and what effects multiply it by.
        """
        total = 0.0
        for s in self.powers:
            correction = correction_of(s, floor, ratio, uncertain_floor)
            total += OVERLAP_WEIGHT * log_likelihood(s, correction.power) - correction.cost
        return total


def view_of(loop: ClosedLoop | None, flights: Sequence[Flight], first: Sequence[dict[str, np.ndarray]],
            pieces: Sequence[tuple[int, str, np.ndarray]]) -> CommandView:
    """The view of the pieces of flights in the air.

    first: of each flight by state the first samples of the replay's blocks; pieces: number of a flight, state, and
    which of these blocks count, bool.
    """
    if loop is None:
        return CommandView(None, _joined(()))
    in_air = [(i, first[i][AIR] + LENGTH[AIR] // 2, chosen) for i, state, chosen in pieces
              if state == AIR and chosen.any()]
    by_flight = [(i, _chosen_spectra(loop, flights[i], middle, chosen)) for i, middle, chosen in in_air]
    by_flight = [(i, s) for i, s in by_flight if len(s)]
    elements, edges = [_of_blocks(loop, i, s) for i, s in by_flight], []
    if loop.edges is not None:
        for i, middle, chosen in in_air:
            for e in edge_response.edges_of(flights[i]):
                nearest = _nearest(middle, e.sample)
                if chosen[nearest] and abs(middle[nearest] - e.sample) <= LENGTH[AIR] // 2:
                    elements.append(_of_edge(loop.edges, flights[i], i, e))
                    edges.append((flights[i], e))
    return CommandView(loop, _joined(elements), [np.abs(s) ** 2 for _, s in by_flight], edges)


def _nearest(middle: np.ndarray, sample: int) -> int:
    """Number of the replay's block whose middle sample is the nearest."""
    return int(np.argmin(np.abs(middle - sample)))


def _chosen_spectra(loop: ClosedLoop, flight: Flight, middle: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Spectra (blocks, bins, AXES) of the blocks of commands whose nearest replay block is chosen.

    middle: middle samples of the replay's blocks.
    """
    begin, spectra = loop.levelled_spectra(flight)
    if not len(begin):
        return spectra
    return spectra[chosen[[_nearest(middle, b + COMMAND_LENGTH // 2) for b in begin]]]


def _of_blocks(loop: ClosedLoop, number: int, spectra: np.ndarray) -> CommandElements:
    """The elements of a flight's blocks (blocks, bins, AXES)."""
    def each(table: np.ndarray) -> np.ndarray:
        """The table's entry for each element."""
        return np.broadcast_to(table, spectra.shape).ravel()

    return CommandElements(
        values=spectra.ravel(), floor=each(loop.floor), channel=each(COMMAND.start + np.arange(len(AXES))),
        frequency=each(command_frequencies()[:, None]), flight=np.full(spectra.size, number),
        freedom=np.full(spectra.size, COMMAND_FREEDOM))


def _of_edge(floor: edge_response.EdgeFloor, flight: Flight, number: int, edge: Edge) -> CommandElements:
    """The elements of a response at an edge, whose power is 1 and which has no frequency."""
    count = edge_response.COUNT
    return CommandElements(
        values=edge_response.whitened(floor, flight, edge).astype(complex), floor=np.ones(count),
        channel=EDGE_CHANNELS, frequency=np.zeros(count), flight=np.full(count, number),
        freedom=np.full(count, EDGE_FREEDOM))


def _joined(parts: Sequence[CommandElements]) -> CommandElements:
    """The elements of all parts, one after another."""
    empty = CommandElements(values=np.zeros(0, complex), floor=np.zeros(0), channel=np.zeros(0, int),
                            frequency=np.zeros(0), flight=np.zeros(0, int), freedom=np.zeros(0))
    return CommandElements(*(np.concatenate(arrays) for arrays in zip(empty, *parts, strict=True)))
