"""Blocks flattened to one array, and their likelihood: Whittle's, of the gap's spectra against the floor.

A bin's power e over what the floor and the random effects give is exponential when the
hypothesis holds; since the floor itself is estimated from few flights, a Student-like
tail stands in for it.
"""

import functools
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import exp1

from airtouch.gap.evidence import random_effects
from airtouch.gap.evidence.cells import BANDS_HZ, COMMAND_VIEW, REPLAY_VIEW, REST_VIEW, cell_numbers
from airtouch.gap.evidence.data import Data, spectra, step_doubt
from airtouch.gap.evidence.likelihood import tailed
from airtouch.gap.loop.closed_loop import COMMAND_ONLY, Change
from airtouch.gap.signals.channels import COMMAND, COUNT, TORQUE
from airtouch.gap.signals.command_view import CommandView
from airtouch.gap.signals.response import FIRST_BIN
from airtouch.gap.signals.spectra import AIR, OVERLAP_WEIGHT, REST, blocks, frequencies, judged, squared
from airtouch.gap.signatures.candidates import MEAN, Term, random_of
from airtouch.gap.workspace import Workspace
from airtouch.simulation.effects import Active

OFFSETS = 6  #: channels (force, torque) whose mean may differ from flight to flight
LOOP = frozenset({"sensor_latency", "controller_gain"})  #: effects that only the loop's spectra show
#: relative error of the loop model in a change of the torque by effects that change the loop; chosen (host/docs/gap.md)
DOUBT = 0.25
FREEDOM = 12.0  #: most degrees of freedom of the Student-like tail; chosen: four blocks, three for each


@dataclass(frozen=True)
class Part:
    """Which blocks of which flights: (flight, regime, chosen bool array), for fitting or judging."""

    pieces: tuple[tuple[int, str, np.ndarray], ...]


class Problem:
    """Blocks flattened to one array: rows are (block, bin, channel) values that count."""

    def __init__(self, data: Data, part: Part) -> None:
        # the data keeps its problems: no cycle, no garbage to wait for
        self.data, self.part, self.workspace = weakref.proxy(data), part, Workspace()
        self._constant: list[tuple[np.ndarray, float]] | None = None
        self.keep = {r: judged(r) for r in (AIR, REST)}
        for keep in self.keep.values():
            keep[:, COMMAND] = False  # the command view judges them
        if data.slow:
            self.keep[AIR][FIRST_BIN:, TORQUE] = False
        self.commands = CommandView(data.study.controller, data.flights, data.first, part.pieces)
        self.noise = self._gather([{r: data.study.floor.level(f, b[r], r) for r in b}
                                   for f, b in zip(data.flights, data.first, strict=True)]).real
        self.power = self.noise + self._gather([{AIR: lost, REST: np.zeros(base[REST].shape)}
                                                for lost, base in zip(data.bridging, data.base, strict=True)]).real
        self.channel = self._gather([{r: np.broadcast_to(np.arange(COUNT), s[r].shape) for r in s}
                                     for s in data.base]).real.astype(int)
        self.flight = np.concatenate([np.full(self._size(p), p[0]) for p in part.pieces]) \
            if part.pieces else np.zeros(0, int)
        self.base = self._gather(data.base)
        self.known = np.isfinite(self.base)
        self.power = np.where(self.known, self.power, 1.0)
        self.base = np.where(self.known, self.base, 0.0)
        counts = data.study.floor.blocks
        nu = [np.full(self._size(p), np.clip(3.0 * counts[p[1]], 2.0, FREEDOM)) for p in part.pieces]
        self.freedom = np.concatenate(nu) if nu else np.zeros(0)
        self.own = len(self.base)  #: elements of the replay view; those of the command view follow
        self.torque = (self.channel >= TORQUE.start) & (self.channel < TORQUE.stop)
        #: number of the block in the air of each element, -1 for the others; begin, piece: of each such block the first
        self.block = self._blocks()  #: sample and the flight
        commands = self.commands
        self.power = np.concatenate([self.power, commands.floor])
        self.base = np.concatenate([self.base, commands.values])
        self.known = np.concatenate([self.known, np.ones(len(commands), bool)])
        self.channel = np.concatenate([self.channel, commands.channel]).astype(int)
        self.flight = np.concatenate([self.flight, commands.flight]).astype(int)
        self.tail = np.concatenate([tail(self.freedom), commands.freedom])  #: the commands' floor has its tails in it
        self.freedom = np.concatenate([self.freedom, commands.freedom])

    def _blocks(self) -> np.ndarray:
        out, begin, flights = [], [], []
        for i, regime, chosen in self.part.pieces:
            size = int(self.keep[regime].sum())
            numbers = np.full(int(chosen.sum()), -1)
            if regime == AIR:
                numbers = len(begin) + np.arange(len(numbers))
                begin += list(self.data.first[i][AIR][chosen])
                flights += [i] * len(numbers)
            out.append(np.repeat(numbers, size))
        self.begin, self.piece = np.array(begin, int), np.array(flights, int)
        return np.concatenate([*out, np.full(len(self.commands), -1)]).astype(int)

    @functools.cached_property
    def groups(self) -> np.ndarray:
        """Number of the cell of each flattened value (`cells`)."""
        groups = []
        for _, regime, chosen in self.part.pieces:
            band = np.digitize(frequencies(regime), BANDS_HZ) - 1
            table = cell_numbers(REST_VIEW if regime == REST else REPLAY_VIEW, band[:, None], np.arange(COUNT))
            groups.append(np.tile(table[self.keep[regime]], int(chosen.sum())))
        own = self.commands
        of_commands = cell_numbers(COMMAND_VIEW, np.digitize(own.frequency, BANDS_HZ), own.channel) \
            if len(own) else np.zeros(0)
        return np.concatenate([*groups, of_commands]).astype(int) if groups else np.zeros(0, int)

    def _size(self, piece: tuple[int, str, np.ndarray]) -> int:
        return int(piece[2].sum()) * int(self.keep[piece[1]].sum())

    def _gather(self, by_flight: Sequence[dict[str, np.ndarray]]) -> np.ndarray:
        parts = [by_flight[i][r].take(places) for (i, r, _), places in zip(self.part.pieces, self._places, strict=True)]
        return np.concatenate(parts) if parts else np.zeros(0, complex)

    @functools.cached_property
    def _places(self) -> list[np.ndarray]:
        """Of each piece, the indices of its values in the flattened spectra of its flight."""
        return [np.flatnonzero(chosen[:, None, None] & self.keep[r]) for _, r, chosen in self.part.pieces]

    def values(self, active: Sequence[Active]) -> np.ndarray:
        """Spectra with effects in the model, flattened."""
        replayed = [a for a in active if a.effect.name not in COMMAND_ONLY or a.effect.name in LOOP]
        replay_values = self._gather(spectra(self.data, replayed)) if replayed else self.base[:self.own]
        command_values = self.commands.moved([a for a in active if not a.gate])
        return np.where(self.known, self.with_commands(replay_values, command_values), 0.0)

    def with_commands(self, own: np.ndarray, of_commands: np.ndarray | float = 0.0) -> np.ndarray:
        """Elements of the replay view, followed by one value, or one each, for those of the commands."""
        return np.concatenate([own, np.broadcast_to(of_commands, len(self.commands))])

    def commanded(self, active: Sequence[Active], wide: bool = False) -> tuple[np.ndarray, float]:
        """Power that a hypothesis adds to the commands' floor, flattened, and its cost. `wide`: CommandView."""
        power, cost = self.commands.power([a for a in active if not a.gate], wide)
        return np.concatenate([self.of_torque(active), power - self.commands.floor]), cost

    def modelled(self, terms: Sequence[Term], wide: bool = False) -> tuple[np.ndarray, np.ndarray, float]:
        """A hypothesis: spectra that its mean effects leave, the power that it adds, and what its floor costs."""
        random = random_of(terms)
        mean = [t.active() for t in terms if t.kind == MEAN]
        command_power, cost = self.commanded([*mean, *(t.active() for t in random)], wide or bool(random))
        return self.values(mean), self.random_power(random) + command_power, cost

    def of_torque(self, active: Sequence[Active]) -> np.ndarray:
        """Power (own,) that effects of the loop add to the floor of the torque.

        It is the power that the changed loop makes of noise, less the present one's, and the loop model's error.
        """
        law = self.data.study.controller
        loop = [a for a in active if a.effect.name not in COMMAND_ONLY or a.effect.name in LOOP] if law else []
        if not self.own or not loop or not law.changes_loop(loop):
            return np.zeros(self.own)
        change = np.where(self.known[:self.own], self._gather(spectra(self.data, loop)) - self.base[:self.own], 0.0)
        steps = step_doubt(self.data, loop)
        doubt = DOUBT ** 2 * squared(change) * self.torque + (0.0 if steps is None else self._gather(steps).real)
        return doubt + self.noise * self._noise(law.torque_change(loop, frequencies(AIR)))

    def _noise(self, change: Change) -> np.ndarray:
        """Factor (own,) of a changed loop on the torque's floor, less 1, as far as the floor is noise of the loop."""
        before, after = change.unexplained
        table = np.zeros((len(before), COUNT))
        nominal = self.data.study.floor.power[AIR][:, TORQUE]
        table[FIRST_BIN:, TORQUE] = (np.minimum(before / nominal, 1.0) * (after / before - 1.0))[FIRST_BIN:]
        parts = [np.tile(table[self.keep[AIR]], int(chosen.sum())) if regime == AIR else
                 np.zeros(self._size((i, regime, chosen))) for i, regime, chosen in self.part.pieces]
        return np.concatenate(parts) if parts else np.zeros(0)

    def bends(self, before: Sequence[Active], after: Sequence[Active]) -> bool:
        """Whether the loops of roll and pitch differ between two hypotheses."""
        law = self.data.study.controller
        return law is not None and not law.same_loop(before, after)

    def constant(self) -> list[tuple[np.ndarray, float]]:
        """Spectra of a unit offset in each of the OFFSETS channels of each flight, with its prior's deviation."""
        if self._constant is None:
            self._constant = self._constants()
        return self._constant

    @functools.cached_property
    def offsets(self) -> list[tuple[np.ndarray, np.ndarray, float]]:
        """`constant` without zeros: indices, values there, deviation. No two have an index in common."""
        places = [np.flatnonzero(column) for column, _ in self.constant()]
        return [(here, column[here], spread) for here, (column, spread) in zip(places, self.constant(), strict=True)]

    def _constants(self) -> list[tuple[np.ndarray, float]]:
        columns = []
        spread = self.data.study.floor.offset
        for i, flight in enumerate(self.data.flights):
            for c in range(OFFSETS):
                if spread[c] <= 0.0:
                    continue
                ones = np.zeros((len(flight), COUNT))
                ones[~flight.on_ground, c] = 1.0
                unit = [{r: blocks(ones, f[r], r) if j == i else np.zeros_like(self.data.base[j][r])
                         for r in f} for j, f in enumerate(self.data.first)]
                columns.append((self.with_commands(self._gather(unit)), float(spread[c])))
        return columns

    def random_power(self, terms: Sequence[Term]) -> np.ndarray:
        """PSD that random effects add, flattened."""
        total = np.zeros(len(self.base))
        for term in terms:
            total += self.with_commands(self._gather(random_effects.power(self.data, term)).real)
        return total

    def likelihood(self, values: np.ndarray, added: np.ndarray | float = 0.0) -> float:
        """Log likelihood of a residual; only differences mean something."""
        return self.likelihood_of(squared(values), added)

    def likelihood_of(self, size: np.ndarray, added: np.ndarray | float = 0.0) -> float:
        """The same, from the values' squared size: for one set of values and many powers."""
        return -OVERLAP_WEIGHT * tailed(size, self.power + added, self.tail, self._falls, self.known)

    def power_slopes(self, values: np.ndarray, added: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Slope and expected curvature (own,) of the log likelihood against the expected power of each value.

        Values are those of the replay view.
        """
        own = slice(self.own)
        power = self.power[own] + added[own]
        e = squared(values[own]) / power
        share = OVERLAP_WEIGHT * self.known[own] / power
        return share * ((self.freedom[own] + 1.0) * e / (self.tail[own] + e) - 1.0), share / power

    def each(self, values: np.ndarray, added: np.ndarray | float = 0.0) -> np.ndarray:
        """Log likelihood of each value."""
        each = _each(squared(values), self.power + added, self.tail, self._falls)
        each[~self.known] = 0.0
        return each

    def likelihoods(self, size: np.ndarray, others: np.ndarray, unit: np.ndarray) -> Callable[[float], float]:
        """`likelihood_of` of others + x * unit as a function of x: only what changes with x is computed anew."""
        grows = (unit != 0.0) & self.known
        rest = tailed(size, self.power + others, self.tail, self._falls, self.known & ~grows)
        own = np.flatnonzero(grows)
        power, tail, falls, known = (x[own] for x in (self.power + others, self.tail, self._falls, self.known))
        own_size, own_unit = size[own], unit[own]

        def at(x: float) -> float:
            """Log likelihood at x."""
            return -OVERLAP_WEIGHT * (rest + tailed(own_size, power + x * own_unit, tail, falls, known))

        return at

    @functools.cached_property
    def _falls(self) -> np.ndarray:
        """Power of the tails' fall."""
        return self.freedom + 1.0


def _each(size: np.ndarray, power: np.ndarray, tail: np.ndarray, falls: np.ndarray) -> np.ndarray:
    """Log likelihood of values of a squared size; in place of the power."""
    tails = size / power
    tails /= tail
    np.log1p(tails, out=tails)
    tails *= falls
    np.log(power, out=power)
    power += tails
    power *= -OVERLAP_WEIGHT
    return power


def tail(freedom: np.ndarray) -> np.ndarray:
    """Scale (n,) of tails whose likelihood is highest at the mean of exponential power:

    E[(nu + 1) e / (tail + e)] = 1.
    """
    return np.array([_tail(nu) for nu in np.unique(freedom)])[np.unique(freedom, return_inverse=True)[1]] \
        if len(freedom) else freedom


@functools.cache
def _tail(nu: float) -> float:
    return float(brentq(lambda a: a * np.exp(a) * exp1(a) - nu / (nu + 1.0), 1e-3, 600.0))


def whole_of(data: Data, flights: Sequence[int] | None = None) -> Part:
    """Every block of every flight, one and the same part in each call, or of the flights of these numbers."""
    if flights is None:
        return data.workspace.once("whole", (), lambda: whole_of(data, range(len(data.flights))))
    return Part(tuple((i, r, np.ones(len(data.first[i][r]), bool)) for i in flights for r in (AIR, REST)
                      if len(data.first[i][r])))


def problem_of(data: Data, part: Part) -> Problem:
    """The flattened blocks of a part, made once."""
    return data.workspace.once("problem", id(part), lambda: (part, Problem(data, part)))[1]  # the part lives as long
