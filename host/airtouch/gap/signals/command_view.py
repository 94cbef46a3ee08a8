"""The command view: a flight's logged commands held against those of nominal flights, and how likely they are.

All compared values stand one after another (elements,). First the spectra (blocks, bins, AXES) of the commands of each
flight: the power e of a value against p = floor x ratio x correction, (bins, AXES) each: of nominal flights, of the
hypothesis over none (`ClosedLoop.ratio`), of this flight (`floor_correction`). Then the whitened responses at edges
(edges, COUNT): each value less what effects add to it, of power 1. The log likelihood of a value of a spectrum is

    -log p - (nu + 1) log(1 + e / (nu p))            Student-like tails of nu = FREEDOM degrees of freedom

less the correction's cost; each block is counted half, as half overlapping blocks hold every sample twice.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airtouch.gap.edges import edge_effects, edge_response
from airtouch.gap.flights.flight import Flight
from airtouch.gap.loop.closed_loop import ClosedLoop
from airtouch.gap.loop.command_spectra import FREEDOM, LENGTH, frequencies
from airtouch.gap.loop.controller import AXES
from airtouch.gap.signals.channels import COMMAND
from airtouch.gap.signals.floor_correction import correction_of, smooth_shapes
from airtouch.gap.signals.spectra import AIR, OVERLAP_WEIGHT
from airtouch.gap.signals.spectra import LENGTH as AIR_LENGTH
from airtouch.gap.signatures.signature import signature_of
from airtouch.gap.workspace import Workspace
from airtouch.logs.edges import Edge
from airtouch.simulation.effects import Active

EDGE_FREEDOM = 6.0  #: degrees of freedom of the Student-like tails of responses at edges; chosen
KEPT = 300  #: hypotheses whose expected power is cached; chosen
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


class CommandView:
    """The commands of some flights: values with their floor, and their expected power under a hypothesis.

    flights, spectra, powers: number of each flight that has blocks, their spectra (blocks, bins, AXES), and the squares
    of these; edges: (flight, its number, edge) of each edge. values, floor, channel, frequency, flight, freedom: what
    `CommandElements` holds of all of them, first the spectra, flight by flight, then the responses at edges.
    """

    def __init__(self, loop: ClosedLoop | None, flights: Sequence[Flight], first: Sequence[dict[str, np.ndarray]],
                 pieces: Sequence[tuple[int, str, np.ndarray]]) -> None:
        """The view of the pieces in the air. loop: of nominal flights; without one the view has no element.

        first: of each flight by regime the first samples of the replay's blocks; pieces: number of a flight, regime,
        and which of these blocks count, bool.
        """
        self._loop, self.workspace = loop, Workspace()
        in_air = [(i, first[i][AIR] + AIR_LENGTH[AIR] // 2, chosen) for i, regime, chosen in pieces
                  if loop is not None and regime == AIR and chosen.any()]
        by_flight = [(i, self._chosen_spectra(flights[i], middle, chosen)) for i, middle, chosen in in_air]
        self.flights, self.spectra = [i for i, s in by_flight if len(s)], [s for _, s in by_flight if len(s)]
        self.powers = [np.abs(s) ** 2 for s in self.spectra]
        self.edges = [(flights[i], i, e) for i, middle, chosen in in_air for e in self._chosen_edges(
            flights[i], middle, chosen)]
        self.values, self.floor, self.channel, self.frequency, self.flight, self.freedom = _joined([
            *(self._of_blocks(i, s) for i, s in zip(self.flights, self.spectra, strict=True)),
            *(self._of_edge(flight, i, e) for flight, i, e in self.edges)])

    def _chosen_spectra(self, flight: Flight, middle: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """Spectra (blocks, bins, AXES) of the blocks of commands whose nearest replay block is chosen.

        middle: middle samples of the replay's blocks.
        """
        begin, spectra = self.loop.levelled_spectra(flight)
        if not len(begin):
            return spectra
        nearest = np.argmin(np.abs(begin[:, None] + LENGTH // 2 - middle), axis=1)
        return spectra[chosen[nearest]]

    def _chosen_edges(self, flight: Flight, middle: np.ndarray, chosen: np.ndarray) -> list[Edge]:
        """Edges of a flight whose nearest replay block is chosen; none where nominal flights cross no edge."""
        if self.loop.edges is None:
            return []
        return [e for e in edge_response.edges_of(flight) if chosen[np.argmin(np.abs(middle - e.sample))]]

    def _of_blocks(self, number: int, spectra: np.ndarray) -> CommandElements:
        """The elements of a flight's blocks (blocks, bins, AXES)."""
        def each(table: np.ndarray) -> np.ndarray:
            """The table's entry for each element."""
            return np.broadcast_to(table, spectra.shape).ravel()

        return CommandElements(
            values=spectra.ravel(), floor=each(self.loop.floor), channel=each(COMMAND.start + np.arange(len(AXES))),
            frequency=each(frequencies()[:, None]), flight=np.full(spectra.size, number),
            freedom=np.full(spectra.size, FREEDOM))

    def _of_edge(self, flight: Flight, number: int, edge: Edge) -> CommandElements:
        """The elements of a response at an edge, whose power is 1 and which has no frequency."""
        count = edge_response.COUNT
        return CommandElements(
            values=edge_response.whitened(self._edge_floor, flight, edge).astype(complex), floor=np.ones(count),
            channel=EDGE_CHANNELS, frequency=np.zeros(count), flight=np.full(count, number),
            freedom=np.full(count, EDGE_FREEDOM))

    def __len__(self) -> int:
        return len(self.values)

    @property
    def loop(self) -> ClosedLoop:
        """The loop that the commands are held against; only asked for where there are any."""
        assert self._loop is not None
        return self._loop

    @property
    def _edge_floor(self) -> edge_response.EdgeFloor:
        """The floor of responses at edges; only asked for where there are any."""
        assert self.loop.edges is not None
        return self.loop.edges

    def values_without(self, active: Sequence[Active]) -> np.ndarray:
        """Values (elements,) less what effects add to the responses at edges; the spectra stay as they are."""
        if not self.edges or not any(signature_of(a.effect).at_edges for a in active):
            return self.values
        out = self.values.copy()
        at = len(out) - len(self.edges) * edge_response.COUNT
        for flight, _, e in self.edges:
            out[at:at + edge_response.COUNT] -= edge_effects.added_response(self._edge_floor, flight, e, active)
            at += edge_response.COUNT
        return out

    def power(self, active: Sequence[Active], wide: bool = False) -> tuple[np.ndarray, float]:
        """Expected power (elements,) with the floor's correction fitted anew, and what that costs, nats.

        wide: the floor is as uncertain as random effects make it (`floor_correction.WIDE`).
        """
        if not self.spectra:
            return self.floor, 0.0
        ratio = self.loop.ratio(active)
        return self.workspace.cached("power", (ratio.tobytes(), wide), lambda: self._expected(ratio, wide), KEPT)

    def _expected(self, ratio: np.ndarray, wide: bool) -> tuple[np.ndarray, float]:
        """`power` where effects multiply that of the commands by a ratio (bins, AXES)."""
        powers, cost = [], 0.0
        for s in self.powers:
            correction = correction_of(s, self.loop.floor, ratio, wide)
            cost += correction.cost
            powers.append(np.broadcast_to(self.loop.floor * ratio * np.exp(correction.log_power), s.shape).ravel())
        powers.append(np.ones(len(self.edges) * edge_response.COUNT))
        return np.concatenate(powers), cost

    def rise(self, before: Sequence[Active], after: Sequence[Active]) -> np.ndarray:
        """Rise (bins, AXES) of the log of the expected power from one hypothesis to another; (0, AXES) for none."""
        if not self.spectra:
            return np.zeros((0, len(AXES)))
        return np.log(self.loop.ratio(after) / self.loop.ratio(before))

    def slopes(self, active: Sequence[Active], rise: np.ndarray, wide: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Gradient (k,) and information (k, k) of the log likelihood for k scaled parameters.

        rise (k, bins, AXES): of the logarithm of the power per scaled parameter; active, wide: see `power`.
        """
        k = len(rise)
        gradient, information = np.zeros(k), np.zeros((k, k))
        if not rise.any():
            return gradient, information
        ratio = self.loop.ratio(active)
        for i in np.flatnonzero(rise.any(axis=(1, 2))):
            up, down = (self._level(ratio * np.exp(sign * SMALL * rise[i]), wide) for sign in (1.0, -1.0))
            gradient[i] = (up - down) / (2.0 * SMALL)
        for s in self.powers:
            correction = correction_of(s, self.loop.floor, ratio, wide)
            for axis in range(len(AXES)):  # what the shapes can take up tells nothing
                slope = rise[:, :, axis]
                cross = correction.weight * slope @ smooth_shapes().T
                information += correction.weight * slope @ slope.T - cross @ correction.covariance @ cross.T
        return gradient, information

    def _level(self, ratio: np.ndarray, wide: bool) -> float:
        """Log likelihood of the spectra, less the costs of the floor's correction.

        ratio (bins, AXES): by which effects multiply the floor.
        """
        total = 0.0
        for s in self.powers:
            correction = correction_of(s, self.loop.floor, ratio, wide)
            power = self.loop.floor * ratio * np.exp(correction.log_power)
            tails = (FREEDOM + 1.0) * np.log1p(s / (power * FREEDOM))
            total -= OVERLAP_WEIGHT * float((np.log(power) + tails).sum()) + correction.cost
        return total


def _joined(parts: Sequence[CommandElements]) -> CommandElements:
    """The elements of all parts, one after another."""
    empty = CommandElements(values=np.zeros(0, complex), floor=np.zeros(0), channel=np.zeros(0, int),
                            frequency=np.zeros(0), flight=np.zeros(0, int), freedom=np.zeros(0))
    return CommandElements(*(np.concatenate(arrays) for arrays in zip(empty, *parts, strict=True)))
