"""Likelihood of the commands' spectra under a hypothesis: the command view's part of a fit.

The power e of a bin of a block is held against floor x ratio x correction. The ratio is the hypothesis's
(`ClosedLoop.ratio`). The floor may be wrong (few nominal flights, other air on other days): its logarithm is off by a
few smooth shapes, each with a normal prior, whose amounts are fitted anew for every flight and axis. Per bin the log
likelihood is that of Student-like tails of nu = FREEDOM degrees of freedom,

    -log power - (nu + 1) log(1 + e / (nu power)),

each block counted half, as half overlapping blocks hold every sample twice. The correction is integrated out by
Laplace's method (MacKay, Information Theory, Inference, and Learning Algorithms, 2003, chapter 27); its cost is what
that takes from the likelihood at its best amounts.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import float64, njit

from airtouch.gap.edges import edge_effects, edge_response
from airtouch.gap.flights.flight import Flight
from airtouch.gap.loop.closed_loop import ClosedLoop
from airtouch.gap.loop.command_spectra import FREEDOM, LENGTH, frequencies
from airtouch.gap.loop.controller import AXES
from airtouch.gap.signals.channels import COMMAND
from airtouch.gap.signals.spectra import AIR, OVERLAP_WEIGHT
from airtouch.gap.signals.spectra import LENGTH as AIR_LENGTH
from airtouch.gap.signatures.signature import signature_of
from airtouch.gap.workspace import Workspace
from airtouch.logs.edges import Edge
from airtouch.simulation.effects import Active

EDGE_FREEDOM = 6.0  #: degrees of freedom of the Student-like tails of responses at edges; chosen
SHAPES = 5  #: smooth shapes by which the floor's logarithm may differ from flight to flight; chosen
#: nepers of power, standard deviation of the amounts of these shapes: of the level, of the others; chosen
SPREAD = (0.10, 0.04)
ROUNDS = 4  #: Newton steps to the floor's correction; chosen
#: factor on `SPREAD` where random effects shake the loop in ways that no log holds; chosen
WIDE = 6.0
DOUBT = 0.1  #: relative error of the loop model in the logarithm of a change of the spectra by effects; chosen
KEPT = 300  #: hypotheses whose expected power is cached; chosen
SMALL = 1e-3  #: change of a scaled parameter over which the likelihood's slope is taken; chosen
#: channel of each number of a response at an edge: thrust by the thrust command, speed by pitch, height by thrust
EDGE_CHANNELS = np.repeat([COMMAND.start, COMMAND.start + AXES.index("pitch"), COMMAND.start],
                          [n for _, n in edge_response.BINS])


class Elements(NamedTuple):
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


class Correction(NamedTuple):
    """What the floor is off by in one flight, under a hypothesis.

    log_power (bins, AXES): added to the logarithm of the floor's power; cost: nats; weight: of all blocks together;
    covariance (SHAPES, SHAPES): of the amounts of the shapes, the same for every axis.
    """

    log_power: np.ndarray
    cost: float
    weight: float
    covariance: np.ndarray


class CommandView:
    """Blocks of the commands of some flights: values (elements,) with their floor, ratio and slopes.

    First the spectra of all blocks, flight by flight, then the responses at edges.
    """

    def __init__(self, loop: ClosedLoop | None, flights: Sequence[Flight], first: Sequence[dict[str, np.ndarray]],
                 pieces: Sequence[tuple[int, str, np.ndarray]]) -> None:
        """The view of the pieces in the air. loop: of nominal flights; None for no view, which has no element.

        first: of each flight by regime the first samples of the replay's blocks; pieces: number of a flight, regime,
        and which of these blocks count, bool.
        """
        self._loop, self.workspace = loop, Workspace()
        self.shapes, self.spread = shapes(), np.array([SPREAD[0]] + [SPREAD[1]] * (SHAPES - 1))
        in_air = [(i, first[i][AIR] + AIR_LENGTH[AIR] // 2, chosen) for i, regime, chosen in pieces
                  if loop is not None and regime == AIR and chosen.any()]
        by_flight = [(i, self._chosen_spectra(flights[i], middle, chosen)) for i, middle, chosen in in_air]
        #: number of each flight that has blocks, and their spectra (blocks, bins, AXES)
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

    def _of_blocks(self, number: int, spectra: np.ndarray) -> Elements:
        """The elements of a flight's blocks (blocks, bins, AXES)."""
        def each(table: np.ndarray) -> np.ndarray:
            return np.broadcast_to(table, spectra.shape).ravel()

        return Elements(values=spectra.ravel(), floor=each(self.loop.floor),
                        channel=each(COMMAND.start + np.arange(len(AXES))), frequency=each(frequencies()[:, None]),
                        flight=np.full(spectra.size, number), freedom=np.full(spectra.size, FREEDOM))

    def _of_edge(self, flight: Flight, number: int, edge: Edge) -> Elements:
        """The elements of a response at an edge, whose power is 1 and which has no frequency."""
        count = edge_response.COUNT
        return Elements(values=edge_response.whitened(self._edge_floor, flight, edge).astype(complex),
                        floor=np.ones(count), channel=EDGE_CHANNELS, frequency=np.zeros(count),
                        flight=np.full(count, number), freedom=np.full(count, EDGE_FREEDOM))

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

    def moved(self, active: Sequence[Active]) -> np.ndarray:
        """Values (elements,) less what effects add to the responses at edges."""
        if not self.edges or not any(signature_of(a.effect).at_edges for a in active):
            return self.values
        out = self.values.copy()
        at = len(out) - len(self.edges) * edge_response.COUNT
        for flight, _, e in self.edges:
            out[at:at + edge_response.COUNT] -= edge_effects.expected(self._edge_floor, flight, e, active)
            at += edge_response.COUNT
        return out

    def power(self, active: Sequence[Active], wide: bool = False) -> tuple[np.ndarray, float]:
        """Expected power (elements,) with the floor's correction fitted anew, and what that costs, nats.

        wide: the floor is as uncertain as random effects make it (WIDE).
        """
        if not self.spectra:
            return self.floor, 0.0
        ratio = self.loop.ratio(active)
        return self.workspace.once("power", (ratio.tobytes(), wide), lambda: self._expected(ratio, wide), KEPT)

    def _expected(self, ratio: np.ndarray, wide: bool) -> tuple[np.ndarray, float]:
        """`power` where that of the commands is a multiple (bins, AXES) of nominal flights'."""
        powers, cost = [], 0.0
        for s in self.powers:
            correction = self._correction(s, ratio, wide)
            cost += correction.cost
            powers.append(np.broadcast_to(self.loop.floor * ratio * np.exp(correction.log_power), s.shape).ravel())
        powers.append(np.ones(len(self.edges) * edge_response.COUNT))
        return np.concatenate(powers), cost

    def rise(self, before: Sequence[Active], after: Sequence[Active]) -> np.ndarray:
        """By how much the logarithm of the expected power rises (bins, axes) from one hypothesis to another."""
        if not self.spectra:
            return np.zeros((0, len(AXES)))
        return np.log(self.loop.ratio(after) / self.loop.ratio(before))

    def slopes(self, active: Sequence[Active], rise: np.ndarray, wide: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Gradient (k,) and information (k, k) of the likelihood for k parameters.

        rise (k, bins, AXES): of the logarithm of the power by each of them.
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
            correction = self._correction(s, ratio, wide)
            for a in range(len(AXES)):  # what the shapes can take up tells nothing
                j = rise[:, :, a]
                cross = correction.weight * j @ self.shapes.T
                information += correction.weight * j @ j.T - cross @ correction.covariance @ cross.T
        return gradient, information

    def _level(self, ratio: np.ndarray, wide: bool) -> float:
        """Log likelihood of the spectra where power is expected to be a multiple of the floor, less what that costs."""
        total = 0.0
        for s in self.powers:
            correction = self._correction(s, ratio, wide)
            power = self.loop.floor * ratio * np.exp(correction.log_power)
            tails = (FREEDOM + 1.0) * np.log1p(s / (power * FREEDOM))
            total -= OVERLAP_WEIGHT * float((np.log(power) + tails).sum()) + correction.cost
        return total

    def _correction(self, s: np.ndarray, ratio: np.ndarray, wide: bool) -> Correction:
        """The floor's likeliest correction for the power s (blocks, bins, AXES) of a flight, by Newton's method.

        Its information is that of exponential laws: 1 for each bin of a block, times the block's weight.
        """
        over_floor = s / (self.loop.floor * ratio)
        spread = self.spread * (WIDE if wide else 1.0)
        spread = np.hypot(spread, DOUBT * np.sqrt(np.mean(np.log(ratio) ** 2)))
        weight = OVERLAP_WEIGHT * len(s)
        normal = weight * self.shapes @ self.shapes.T + np.diag(1.0 / spread ** 2)
        covariance = np.linalg.inv(normal)
        amount = np.zeros((SHAPES, len(AXES)))
        for _ in range(ROUNDS):
            push = OVERLAP_WEIGHT * _push(over_floor, np.exp(-self.shapes.T @ amount))
            amount += covariance @ (self.shapes @ push - amount / spread[:, None] ** 2)
        cost = 0.5 * float(((amount / spread[:, None]) ** 2).sum())
        cost += 0.5 * len(AXES) * float(np.linalg.slogdet(normal)[1] + 2.0 * np.log(spread).sum())
        return Correction(self.shapes.T @ amount, cost, weight, covariance)


def shapes() -> np.ndarray:
    """Smooth shapes (SHAPES, bins) over the logarithm of frequency: level, slope, slow waves."""
    x = np.log(frequencies())
    x = (x - x[0]) / (x[-1] - x[0])
    return np.array([np.cos(np.pi * k * x) for k in range(SHAPES)])


@njit(float64[:, ::1](float64[:, :, ::1], float64[:, ::1]), cache=True, error_model="numpy")
def _push(over, factor):
    """Slope (bins, axes) of the log likelihood of all blocks by the logarithm of their power.

    over (blocks, bins, axes): power over the floor's, times a factor.
    """
    out = np.zeros(factor.shape)
    for block in over:
        for b in range(out.shape[0]):
            for a in range(out.shape[1]):
                e = block[b, a] * factor[b, a]
                out[b, a] += (FREEDOM + 1.0) * e / (FREEDOM + e) - 1.0
    return out


def _joined(parts: Sequence[Elements]) -> Elements:
    """Elements one after another."""
    empty = Elements(values=np.zeros(0, complex), floor=np.zeros(0), channel=np.zeros(0, int), frequency=np.zeros(0),
                     flight=np.zeros(0, int), freedom=np.zeros(0))
    return Elements(*(np.concatenate(arrays) for arrays in zip(empty, *parts, strict=True)))
