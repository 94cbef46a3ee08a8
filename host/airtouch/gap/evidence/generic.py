"""What no named effect explains: a model without names of what a hypothesis leaves.

Two parts, both found on one half of the data and judged on the other. The first is a
regression of every force, torque and rate on the flight's own signals: thrust and how
it changes, roll, pitch and yaw commands, velocity, tilt, height over what is below, time.
In flights of this project's simulator, whose loop is modelled, roll and pitch torque is regressed on that of the logged
commands as well, band by band, in time with them and a quarter turn later: how else they turn the vehicle.
The second is a free power in every view, channel and band. Only columns and bands that
gain more than chance among so many does are used. What nominal flights have of a column
or a band is no evidence: as far as they scatter, the coefficient is taken away at no gain.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from airtouch.gap.evidence.basis import BASIS, basis
from airtouch.gap.evidence.data import Data, commanded
from airtouch.gap.evidence.problem import BANDS_HZ, GROUPS, Part, Problem, problem_of, whole_of
from airtouch.gap.signals.channels import COUNT, TORQUE
from airtouch.gap.signals.response import FIRST_BIN
from airtouch.gap.signals.spectra import AIR, OVERLAP_WEIGHT, blocks, frequencies, squared
from airtouch.gap.signatures.candidates import MEAN, SPECTRUM, Term

CHANNELS = 9  #: that are regressed: force, torque, rate
ROLL_PITCH = (TORQUE.start, TORQUE.start + 1)  #: torques of a loop that is modelled; of yaw noise of the gyro is most
TURNS = (1.0, 1.0j)  #: with the commands, and a quarter turn later
LOOP_HZ = BANDS_HZ[1:]  #: bands above the means, which the law of the response leaves alone
LOOP = len(TURNS) * (len(LOOP_HZ) - 1)  #: columns of a torque beside the basis
WIDEST = len(BASIS) + LOOP
LIFT, OF_HEIGHT = 2, ("height", "low", "high")  #: channel of the force along the thrust; columns of the height
NOTHING = 1e-9  #: variance of a coefficient that has no scatter
#: columns of the command that turns the vehicle about each axis of the torque
OF_COMMAND = {c: [BASIS.index(n) for n in (a, f"d_{a}")] for c, a in enumerate(("roll", "pitch", "yaw"), TORQUE.start)}
ROUNDS = 3
MOST_COLUMNS = 4  #: of one channel
SURE = 3.0  #: standard deviations by which coefficients must scatter more than chance has them do
BELIEF = 2.0  #: nominal flights that the scatter of power in all channels together counts as, for each band of one
#: of the logarithm of power between flights, at least: no effect's spectrum is modelled any better, and in recorded
LEAST_SCATTER, RECORDED_SCATTER = 0.05, 0.1  #: ones no air is
CHANCE = 4.0  #: gain on the half that it is found on by which a column or a band is used: about one by chance
#: for each group the first of its view and sensor: force, torque, rate; commands, one axis each
SENSOR = np.arange(GROUPS) // 1000 * 1000 + np.arange(GROUPS) % 1000 % COUNT // 3 * 3
ABOVE_MEANS = np.arange(GROUPS) % 1000 >= COUNT  #: groups above the lowest band
LOOSE = (np.zeros(GROUPS), np.full(GROUPS, 1e3))  #: mean and scatter of powers of which nothing is believed


Powers = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]  #: see `HalfResiduals.powers`


@dataclass(frozen=True)
class Usual:
    """Nominal flights: rms of coefficients (CHANNELS, WIDEST), log power's mean and rms (2, GROUPS)."""

    columns: np.ndarray
    power: np.ndarray


def _columns(data: Data) -> list[list[dict[str, np.ndarray]]]:
    """Spectra (blocks, bins, columns) of the basis for x, y and z channels, by flight and regime; made once."""
    def make() -> list[list[dict[str, np.ndarray]]]:
        out = []
        for flight, first in zip(data.flights, data.first, strict=True):
            signals = basis(flight, data.study.vehicle)
            out.append([{r: blocks(signals[:, :, a], first[r], r) for r in first} for a in range(3)])
        return out

    return data.workspace.once("basis", (), make)


def _loop_columns(data: Data) -> list[np.ndarray]:
    """Spectra (blocks, bins, 2, LOOP) in the air of the torque that the model makes of the commands, by flight: each

    band's alone, weighted as what is left of the torque is; made once.
    """
    def make() -> list[np.ndarray]:
        f, response = frequencies(AIR), data.study.response
        bands = np.array([(f >= low) & (f < high) for low, high in pairwise(LOOP_HZ)]).T
        bands[:FIRST_BIN] = False
        shape = np.stack([turn * bands for turn in TURNS], axis=-1).reshape(len(f), 1, LOOP)
        out = []
        for i, torque in enumerate(commanded(data)):
            weighted = torque if response is None else response.weighted(data.quiet[i], torque)
            out.append(np.nan_to_num(weighted)[:, :, :2, None] * shape)
        return out

    return data.workspace.once("loop", (), make)


def _table(data: Data, part: Part, problem: Problem, channel: int) -> np.ndarray:
    """The columns (elements, columns) at the elements of one channel, in their order."""
    every, made = _columns(data), []
    axis, turns = channel % 3, channel in ROLL_PITCH
    for i, r, chosen in part.pieces:
        columns = every[i][axis][r][chosen]
        if turns:
            loop = _loop_columns(data)[i][chosen, :, axis] if r == AIR else np.zeros((*columns.shape[:2], LOOP))
            columns = np.concatenate([columns, loop], axis=2)
        made.append(columns[:, problem.keep[r][:, channel]].reshape(-1, columns.shape[2]))
    return np.concatenate(made) if made else np.zeros((0, len(BASIS)), complex)


@dataclass(frozen=True)
class _Cell:
    """One channel of one flight: elements own, columns (elements, free and offsets), spread of the offsets."""

    channel: int
    own: np.ndarray
    columns: np.ndarray
    offsets: np.ndarray

    @property
    def free(self) -> int:
        """Columns whose coefficient may be anything."""
        return self.columns.shape[1] - len(self.offsets)

    def precision(self, usual: Usual) -> np.ndarray:
        """Of what is believed of each column's coefficient in a nominal flight, and of the offsets."""
        nominal = np.maximum(usual.columns[self.channel, :self.free] ** 2, NOTHING)
        return np.concatenate([1.0 / nominal, 1.0 / self.offsets ** 2])


class HalfResiduals:
    """What a hypothesis leaves of a half: values, the power that they should have, and the basis there.

    cells: every channel of every flight; what nominal flights may have of a column, each flight has for itself.
    """

    def __init__(self, data: Data, part: Part, terms: Sequence[Term]) -> None:
        self.problem = problem = problem_of(data, part)
        self.values, added, _ = problem.modelled(terms)
        self.power = problem.power + added
        self.groups = problem.groups
        self.cells = problem.workspace.once("cells", (), lambda: _cells(data, part, problem))

    def system(self, cell: _Cell, values: np.ndarray, left: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Normal matrix and right-hand side for values of a cell; tails as those of what is left of them."""
        nu, tail, power = self.problem.freedom[cell.own], self.problem.tail[cell.own], self.power[cell.own]
        weights = OVERLAP_WEIGHT * (nu + 1.0) / (tail + squared(left) / power) / power
        weighted = cell.columns.conj().T * weights
        return 2.0 * (weighted @ cell.columns).real, 2.0 * (weighted @ values).real

    def without(self, cell: _Cell, given: np.ndarray, usual: Usual) -> tuple[np.ndarray, float]:
        """A cell without given coefficients and without what nominal flights may have, and its likelihood."""
        values = self.values[cell.own] - cell.columns[:, :cell.free] @ given[:cell.free]
        left, precision = values, cell.precision(usual)
        for _ in range(2):
            normal, right = self.system(cell, values, left)
            x = np.linalg.solve(normal + np.diag(precision), right)
            left = values - cell.columns @ x
        nu, tail = self.problem.freedom[cell.own], self.problem.tail[cell.own]
        tails = (nu + 1.0) * np.log1p(squared(left) / self.power[cell.own] / tail)
        return left, -float(OVERLAP_WEIGHT * tails.sum() + 0.5 * (precision * x ** 2).sum())

    def powers(self, left: np.ndarray) -> Powers:
        """Power of what is left over what it should be, freedom, tail and group of the values that are known."""
        known = self.problem.known
        over = squared(left[known]) / self.power[known]
        return over, self.problem.freedom[known], self.problem.tail[known], self.groups[known]


def _answerable(data: Data, terms: Sequence[Term], channel: int) -> np.ndarray:
    """Whether a column says something new beside a hypothesis, bool (WIDEST,).

    A random torque is in the commands that answer it: what is left follows these, as it should. And how a changed loop
    turns the vehicle about its yaw axis upon a command is not modelled.
    """
    out = np.ones(WIDEST, bool)
    out[len(BASIS):] = data.study.simulated
    law, yaw = data.study.controller, TORQUE.stop - 1
    if any(t.kind == SPECTRUM for t in terms):
        out[OF_COMMAND.get(channel, [])] = False
        out[len(BASIS):] = False
    elif channel == yaw and law is not None and law.changes_loop([t.active() for t in terms if t.kind == MEAN]):
        out[OF_COMMAND[yaw]] = False
    return out


def _cells(data: Data, part: Part, problem: Problem) -> list[_Cell]:
    out = []
    channel, flight, known = (x[:problem.own] for x in (problem.channel, problem.flight, problem.known))
    for c in range(CHANNELS):
        table, every = _table(data, part, problem, c), np.flatnonzero(channel == c)
        for f in np.unique(flight):
            here = known[every] & (flight[every] == f)
            own = every[here]
            offsets = [(x[own], p) for x, p in problem.constant() if np.any(x[own])]
            if len(own):
                out.append(_Cell(c, own, np.column_stack([table[here], *(x for x, _ in offsets)]),
                                 np.array([p for _, p in offsets])))
    return out


def coefficients(half: HalfResiduals, channel: int, usual: Usual, among: np.ndarray | None = None) -> np.ndarray:
    """Coefficients (WIDEST,) that a channel asks for, one column after another; zero for the others.

    among (WIDEST,): the columns that may be asked for; all by default.
    """
    cells = [c for c in half.cells if c.channel == channel]
    found = np.zeros(WIDEST)
    if not cells:
        return found
    n = cells[0].free
    every = [k for k in range(n) if among is None or among[k]]
    left = [half.values[c.own] for c in cells]
    for _ in range(ROUNDS):  # of weights
        told, right = np.zeros((n, n)), np.zeros(n)
        for cell, rest in zip(cells, left, strict=True):  # the flight's own share of every column is solved for
            normal, slope = half.system(cell, half.values[cell.own], rest)
            ridge = normal + np.diag(cell.precision(usual))
            taken = np.linalg.solve(ridge, np.column_stack([normal[:, :n], slope]))
            told += normal[:n, :n] - normal[:n] @ taken[:, :n]
            right += slope[:n] - normal[:n] @ taken[:, n]
        told += np.diag(1e-9 * np.diag(told) + 1e-12)
        free: list[int] = []
        gain = 0.0
        while len(free) < MOST_COLUMNS:
            tried = [(_gain(told, right, [*free, k]), k) for k in every if k not in free]
            if not tried or max(tried)[0] - gain < CHANCE:
                break
            gain, k = max(tried)
            free.append(k)
        found = np.zeros(WIDEST)
        found[free] = np.linalg.solve(told[np.ix_(free, free)], right[free])
        left = [half.without(c, found, usual)[0] for c in cells]
    return found


def _gain(told: np.ndarray, right: np.ndarray, free: Sequence[int]) -> float:
    return 0.5 * float(right[free] @ np.linalg.solve(told[np.ix_(free, free)], right[free]))


def power_factors(e: np.ndarray, nu: np.ndarray, tail: np.ndarray, groups: np.ndarray, middle: np.ndarray,
                  spread: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Logarithm (GROUPS,) of the power's factor of highest posterior, and the log likelihood there."""
    out = middle.copy()
    count = np.bincount(groups, minlength=GROUPS)
    precision = 1.0 / np.maximum(spread ** 2, NOTHING)
    mean_nu = np.bincount(groups, nu / (nu + 3.0), GROUPS)
    for _ in range(8):
        scaled = e * np.exp(-out[groups])
        push = np.bincount(groups, OVERLAP_WEIGHT * ((nu + 1.0) * scaled / (tail + scaled) - 1.0), GROUPS)
        out += np.clip((push - (out - middle) * precision) / (OVERLAP_WEIGHT * mean_nu + precision), -1.5, 1.5)
    out[count == 0] = middle[count == 0]
    scaled = e * np.exp(-out[groups])
    level = np.bincount(groups, -OVERLAP_WEIGHT * (out[groups] + (nu + 1.0) * np.log1p(scaled / tail)), GROUPS)
    return out, level - 0.5 * (out - middle) ** 2 * precision


def generic_gain(data: Data, parts: Sequence[Part], terms: Sequence[Sequence[Term]]) -> tuple[float, float]:
    """Held-out log likelihood that columns, and powers on top of them, add to a hypothesis.

    terms: the hypothesis as fitted on each of the two parts. Less power than nominal flights have counts in simulated
    flights alone: a recorded one had calm air; and not in the band of the means, of which offsets take what they may.
    """
    usual = data.study.usual or nothing_usual()
    linear = power = 0.0
    for train, test in ((0, 1), (1, 0)):
        a, b = (HalfResiduals(data, parts[k], terms[train]) for k in (train, test))
        left = [h.values.copy() for h in (a, b)]
        for channel in range(CHANNELS):
            found = coefficients(a, channel, usual, _answerable(data, terms[train], channel))
            for k, h in enumerate((a, b)):
                for cell in (c for c in h.cells if c.channel == channel):
                    left[k][cell.own], _ = h.without(cell, found, usual)
            linear += _linear_gain(b, channel, found, usual)
        one, two = (h.powers(x) for x, h in zip(left, (a, b), strict=True))
        power += _power_gain(one, two, usual, data.study.simulated)
    return linear, power


def height_gain(data: Data, parts: Sequence[Part]) -> float:
    """Held-out log likelihood that a force along the thrust gains which follows the height over what is below."""
    usual = data.study.usual or nothing_usual()
    halves = [HalfResiduals(data, part, ()) for part in parts]
    among = np.isin(np.arange(WIDEST), [BASIS.index(name) for name in OF_HEIGHT])
    return sum(_linear_gain(halves[test], LIFT, coefficients(halves[train], LIFT, usual, among), usual)
               for train, test in ((0, 1), (1, 0)))


def _linear_gain(half: HalfResiduals, channel: int, found: np.ndarray, usual: Usual) -> float:
    """Log likelihood that the coefficients (WIDEST,) of a channel, found elsewhere, gain on a half."""
    if not found.any():
        return 0.0
    nothing = np.zeros(WIDEST)
    return float(gain_at_even_odds(sum(half.without(c, found, usual)[1] - half.without(c, nothing, usual)[1]
                                       for c in half.cells if c.channel == channel)))


def _power_gain(one: Powers, two: Powers, usual: Usual, simulated: bool) -> float:
    """What free powers, found on one half, gain on the other: of every cell, or of all the bands of a sensor together,

    as noise that is a little stronger shows nowhere alone.
    """
    middle, spread = usual.power
    spread = spread if simulated else np.maximum(spread, RECORDED_SCATTER)
    judged = ABOVE_MEANS if simulated else np.zeros(GROUPS, bool)  # with less power than usual as well
    usually, before = (power_factors(*half, middle, spread)[1] for half in (one, two))
    pools = [(power_factors(*one, middle, LOOSE[1])[0], np.arange(GROUPS))]
    if simulated:  # recorded flights' noise differs from day to day
        pools.append((_of_sensors(one, middle), SENSOR))
    gains = []
    for found, pool in pools:
        free = spread if pool is SENSOR else LOOSE[1]
        trained, gained = (np.bincount(pool, x, GROUPS) for x in (
            power_factors(*one, found, free)[1] - usually, power_factors(*two, found, spread)[1] - before))
        used = (trained > CHANCE) & (np.bincount(pool, (found > middle) | judged, GROUPS) > 0)
        gains.append(float(gain_at_even_odds(gained[used]).sum()))
    return max(gains)


def _of_sensors(powers: Powers, middle: np.ndarray) -> np.ndarray:
    """Logarithm (GROUPS,) of the powers' factors where all bands of a sensor but that of the means share one."""
    e, nu, tail, groups = powers
    there = ABOVE_MEANS[groups]
    over = (e * np.exp(-middle[groups]))[there]
    shared, _ = power_factors(over, nu[there], tail[there], SENSOR[groups][there], *LOOSE)
    return middle + np.where(ABOVE_MEANS, shared[SENSOR], 0.0)


def gain_at_even_odds(gain: np.ndarray | float) -> np.ndarray:
    """Log likelihood gained by something that is there with probability one half."""
    return np.logaddexp(gain, 0.0) - np.log(2.0)


def usual_of(data: Data) -> Usual:
    """How coefficients and powers of nominal flights scatter beyond what chance alone gives."""
    halves = [HalfResiduals(data, whole_of(data, [i]), ()) for i in range(len(data.flights))]
    n = len(halves)
    if n < 2:
        return nothing_usual()
    columns, surprise = np.zeros((2, CHANNELS, WIDEST))
    for h in halves:
        for cell in h.cells:
            found, variance = _one_by_one(h, cell)
            columns[cell.channel, :cell.free] += (found ** 2 - variance) / (n - 1)
            surprise[cell.channel, :cell.free] += found ** 2 / variance / n
    columns[surprise < 1.0 + SURE * np.sqrt(2.0 / n)] = 0.0
    few = (n + 1) / (n - 1)  # another flight may lie farther off than those that are known
    usual = Usual(np.sqrt(np.maximum(few * columns, 0.0)), nothing_usual().power)
    log_power, chance = np.zeros((len(halves), GROUPS)), np.full((len(halves), GROUPS), np.nan)
    for i, h in enumerate(halves):
        left = h.values.copy()
        for cell in h.cells:
            left[cell.own] = h.without(cell, np.zeros(WIDEST), usual)[0]
        e, nu, tail, groups = h.powers(left)
        log_power[i] = power_factors(e, nu, tail, groups, *LOOSE)[0]
        count = np.bincount(groups, OVERLAP_WEIGHT * nu / (nu + 3.0), GROUPS)
        chance[i, count > 0.0] = 1.0 / count[count > 0.0]
    there = np.isfinite(chance)
    count = np.maximum(there.sum(axis=0), 1)
    middle = np.where(there, log_power, 0.0).sum(axis=0) / count
    squares = np.where(there, (log_power - middle) ** 2 - chance, 0.0).sum(axis=0)
    pooled = np.maximum(_of_band(squares) / np.maximum(_of_band(count - 1.0), 1.0), LEAST_SCATTER ** 2)
    own = (np.maximum(squares, 0.0) + BELIEF * pooled) / (count - 1 + BELIEF)
    return Usual(usual.columns, np.stack([middle, np.sqrt(own * (1.0 + 1.0 / count))]))


def _of_band(values: np.ndarray) -> np.ndarray:
    """For each group the sum of values (GROUPS,) over the channels of its view and band."""
    cell = np.arange(GROUPS)
    band = cell - cell % 1000 % COUNT
    return np.bincount(band, values, GROUPS)[band]


def _one_by_one(half: HalfResiduals, cell: _Cell) -> tuple[np.ndarray, np.ndarray]:
    """Coefficient and variance (columns,) of every column of a cell, each beside the offsets alone."""
    n = cell.free
    left = half.without(cell, np.zeros(n), nothing_usual())[0]
    normal, right = half.system(cell, half.values[cell.own], left)
    found, variance = np.zeros(n), np.zeros(n)
    for k in range(n):
        here = [k, *range(n, len(right))]
        precision = np.concatenate([[1e-12], 1.0 / cell.offsets ** 2])
        inverse = np.linalg.inv(normal[np.ix_(here, here)] + np.diag(precision + 1e-9 * np.diag(normal)[here]))
        found[k], variance[k] = (inverse @ right[here])[0], inverse[0, 0]
    return found, variance


def nothing_usual() -> Usual:
    """Where no nominal flight is known: columns and bands as the floor has them."""
    return Usual(np.zeros((CHANNELS, WIDEST)), np.zeros((2, GROUPS)))
