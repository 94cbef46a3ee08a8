"""Likelihood of the commands' spectra under a hypothesis: the command view's part of a fit.

A hypothesis multiplies the floor by a ratio. What the floor may be wrong by (few nominal
flights, other air on other days) is a few smooth shapes of its logarithm, each with a
prior, fitted anew for every flight and axis.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import float64, njit

from airtouch.gap.flights.flight import Flight
from airtouch.gap.loop import edge_response
from airtouch.gap.loop.closed_loop import ClosedLoop
from airtouch.gap.loop.command_spectra import FREEDOM, LENGTH, SHAPES, SPREAD, frequencies, shapes
from airtouch.gap.loop.controller import AXES
from airtouch.gap.signals.spectra import AIR, OVERLAP_WEIGHT
from airtouch.gap.signals.spectra import LENGTH as AIR_LENGTH
from airtouch.gap.workspace import Workspace
from airtouch.simulation.effects import Active

FIRST_CHANNEL = 9  #: of the commands, in `channels.CHANNELS`
EDGE_FREEDOM = 6.0  #: degrees of freedom of the tails of responses at edges
ROUNDS = 4  #: Newton steps to the floor's correction
WIDE = 6.0  #: factor on the spread where random effects shake the loop in ways that no log holds
DOUBT = 0.1  #: relative error of the loop model in the logarithm of a change of the spectra by effects
KEPT = 300  #: hypotheses whose expected power is cached
SMALL = 1e-3  #: change of a scaled parameter over which the likelihood's slope is taken
NOTHING = np.zeros(0)


class CommandView:
    """Blocks of the commands of some flights: values (elements,) with their floor, ratio and slopes."""

    def __init__(self, loop: ClosedLoop | None, flights: Sequence[Flight], first: Sequence[dict[str, np.ndarray]],
                 pieces: Sequence[tuple[int, str, np.ndarray]]) -> None:
        self._loop, self.workspace = loop, Workspace()
        self.spectra: list[np.ndarray] = []
        self.flights: list[int] = []
        if loop is not None:
            for i, regime, chosen in pieces:
                if regime != AIR or not chosen.any():
                    continue
                begin, spectra = loop.levelled_spectra(flights[i])
                middle = first[i][AIR] + AIR_LENGTH[AIR] // 2
                nearest = np.argmin(np.abs(begin[:, None] + LENGTH // 2 - middle), axis=1) if len(begin) else []
                chosen_spectra = spectra[chosen[nearest]] if len(begin) else spectra
                if len(chosen_spectra):
                    self.spectra.append(chosen_spectra)
                    self.flights.append(i)
            self.shapes = shapes()
            self.spread = np.array([SPREAD[0]] + [SPREAD[1]] * (SHAPES - 1))
        self.edges = [] if loop is None or loop.edges is None else [
            (flights[i], i, e) for i, regime, chosen in pieces if regime == AIR and chosen.any()
            for e in edge_response.edges_of(flights[i])
            if chosen[np.argmin(np.abs(first[i][AIR] + AIR_LENGTH[AIR] // 2 - e.sample))]]
        self.sizes = [np.abs(s) ** 2 for s in self.spectra]
        flat = [s.ravel() for s in self.spectra]
        flat += [edge_response.whitened(self._edge_floor, f, e).astype(complex) for f, _, e in self.edges]
        self.values = np.concatenate(flat) if flat else NOTHING.astype(complex)
        self.floor = self._spread_out(lambda i: self.loop.floor)
        axis = np.arange(len(AXES)) + FIRST_CHANNEL
        self.channel = self._spread_out(lambda i: np.broadcast_to(axis, _shape(self.spectra[i])))
        self.frequency = self._spread_out(lambda i: np.repeat(frequencies()[:, None], len(AXES), axis=1))
        self.flight = self._spread_out(lambda i: np.full(_shape(self.spectra[i]), self.flights[i]))
        self.freedom = np.full(len(self.values), FREEDOM)
        more = len(self.edges) * edge_response.COUNT
        if more:
            kind = np.repeat([FIRST_CHANNEL, FIRST_CHANNEL + 2, FIRST_CHANNEL], [n for _, n in edge_response.BINS])
            self.floor = np.concatenate([self.floor, np.ones(more)])
            self.channel = np.concatenate([self.channel, np.tile(kind, len(self.edges))])
            self.frequency = np.concatenate([self.frequency, np.zeros(more)])
            self.flight = np.concatenate([self.flight, np.repeat([i for _, i, _ in self.edges], edge_response.COUNT)])
            self.freedom[-more:] = EDGE_FREEDOM

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

    def _spread_out(self, table_of: Any) -> np.ndarray:
        """A table (bins, axes) for each flight, once for each of its blocks, flattened."""
        made = [np.broadcast_to(table_of(i), s.shape).ravel() for i, s in enumerate(self.spectra)]
        return np.concatenate(made) if made else NOTHING

    def moved(self, active: Sequence[Active]) -> np.ndarray:
        """Values (elements,) less what effects add to the responses at edges."""
        if not self.edges or not any(a.effect.name in edge_response.SHOWN for a in active):
            return self.values
        out = self.values.copy()
        at = len(out) - len(self.edges) * edge_response.COUNT
        for flight, _, e in self.edges:
            out[at:at + edge_response.COUNT] -= edge_response.expected(self._edge_floor, flight, e, active)
            at += edge_response.COUNT
        return out

    def power(self, active: Sequence[Active], wide: bool = False) -> tuple[np.ndarray, float]:
        """Expected power (elements,), the floor's own uncertainty found anew, and what that costs."""
        if not self.spectra:
            return self.floor, 0.0
        ratio = self.loop.ratio(active)
        return self.workspace.once("power", (ratio.tobytes(), wide), lambda: self._expected(ratio, wide), KEPT)

    def _expected(self, ratio: np.ndarray, wide: bool) -> tuple[np.ndarray, float]:
        """`power` where that of the commands is a multiple (bins, AXES) of nominal flights'."""
        made, cost = [], 0.0
        for s in self.sizes:
            wrong, price, _, _ = self._shift(s, ratio, wide)
            cost += price
            made.append(np.broadcast_to(self.loop.floor * ratio * np.exp(wrong), s.shape).ravel())
        made.append(np.ones(len(self.edges) * edge_response.COUNT))
        return np.concatenate(made), cost

    def rise(self, before: Sequence[Active], after: Sequence[Active]) -> np.ndarray:
        """By how much the logarithm of the expected power rises (bins, axes) from one hypothesis to another."""
        if not self.spectra:
            return np.zeros((0, len(AXES)))
        return np.log(self.loop.ratio(after) / self.loop.ratio(before))

    def slopes(self, active: Sequence[Active], rise: np.ndarray, wide: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Gradient (k,) and information (k, k) of the likelihood for k parameters, each of which lets the log power
        `rise`."""
        k = len(rise)
        gradient, information = np.zeros(k), np.zeros((k, k))
        if not rise.any():
            return gradient, information
        ratio = self.loop.ratio(active)
        for i in np.flatnonzero(rise.any(axis=(1, 2))):
            up, down = (self._level(ratio * np.exp(sign * SMALL * rise[i]), wide) for sign in (1.0, -1.0))
            gradient[i] = (up - down) / (2.0 * SMALL)
        for s in self.sizes:
            _, _, count, covariance = self._shift(s, ratio, wide)
            for a in range(len(AXES)):
                j = rise[:, :, a]
                cross = count * j @ self.shapes.T
                information += count * j @ j.T - cross @ covariance @ cross.T
        return gradient, information

    def _level(self, ratio: np.ndarray, wide: bool) -> float:
        """Log likelihood of the spectra where power is expected to be a multiple of the floor, less what that costs."""
        total = 0.0
        for s in self.sizes:
            wrong, cost, _, _ = self._shift(s, ratio, wide)
            power = self.loop.floor * ratio * np.exp(wrong)
            tails = (FREEDOM + 1.0) * np.log1p(s / (power * FREEDOM))
            total -= OVERLAP_WEIGHT * float((np.log(power) + tails).sum()) + cost
        return total

    def _shift(self, s: np.ndarray, ratio: np.ndarray, wide: bool) -> tuple[np.ndarray, float, float, np.ndarray]:
        """Log of the floor's correction (bins, axes), its cost, weight of all blocks, and covariance of the shapes.

        s: power (blocks, bins, axes) of a flight.
        """
        e0 = s / (self.loop.floor * ratio)
        spread = self.spread * (WIDE if wide else 1.0)
        spread = np.hypot(spread, DOUBT * np.sqrt(np.mean(np.log(ratio) ** 2)))
        count = OVERLAP_WEIGHT * len(s)
        normal = count * self.shapes @ self.shapes.T + np.diag(1.0 / spread ** 2)
        covariance = np.linalg.inv(normal)
        amount = np.zeros((SHAPES, len(AXES)))
        for _ in range(ROUNDS):
            push = OVERLAP_WEIGHT * _push(e0, np.exp(-self.shapes.T @ amount))
            amount += covariance @ (self.shapes @ push - amount / spread[:, None] ** 2)
        cost = 0.5 * float(((amount / spread[:, None]) ** 2).sum())
        cost += 0.5 * len(AXES) * float(np.linalg.slogdet(normal)[1] + 2.0 * np.log(spread).sum())
        return self.shapes.T @ amount, cost, count, covariance


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


def _shape(spectra: np.ndarray) -> tuple[int, int]:
    """Bins and axes of spectra (blocks, bins, axes)."""
    return spectra.shape[1], spectra.shape[2]
