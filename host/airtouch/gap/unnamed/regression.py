"""The regression of what a hypothesis leaves, found on one half of the data and judged on the other."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.problem import Part, problem_of
from airtouch.gap.signals.spectra import OVERLAP_WEIGHT, squared
from airtouch.gap.signatures.candidates import Term
from airtouch.gap.unnamed.columns import CHANNELS, WIDEST, Cell, Usual, cells_of, nothing_usual
from airtouch.gap.unnamed.powers import Powers, gain_at_even_odds

ROUNDS = 3
MOST_COLUMNS = 4  #: of one channel
SURE = 3.0  #: standard deviations by which coefficients must scatter more than chance has them do
CHANCE = 4.0  #: gain on the half that it is found on by which a column is used: about one by chance


class HalfResiduals:
    """What a hypothesis leaves of a half: values, the power that they should have, and the basis there.

    cells: every channel of every flight; what nominal flights may have of a column, each flight has for itself.
    """

    def __init__(self, data: Data, part: Part, terms: Sequence[Term]) -> None:
        self.problem = problem = problem_of(data, part)
        self.values, added, _ = problem.modelled(terms)
        self.power = problem.power + added
        self.groups = problem.groups
        self.cells = cells_of(data, part, problem)

    def system(self, cell: Cell, values: np.ndarray, left: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Normal matrix and right-hand side for values of a cell; tails as those of what is left of them."""
        nu, tail, power = self.problem.freedom[cell.own], self.problem.tail[cell.own], self.power[cell.own]
        weights = OVERLAP_WEIGHT * (nu + 1.0) / (tail + squared(left) / power) / power
        weighted = cell.columns.conj().T * weights
        return 2.0 * (weighted @ cell.columns).real, 2.0 * (weighted @ values).real

    def without(self, cell: Cell, given: np.ndarray, usual: Usual) -> tuple[np.ndarray, float]:
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

    def rest(self, usual: Usual) -> Powers:
        """`powers` without what nominal flights may have of the columns."""
        left = self.values.copy()
        for cell in self.cells:
            left[cell.own] = self.without(cell, np.zeros(WIDEST), usual)[0]
        return self.powers(left)


def coefficients(half: HalfResiduals, channel: int, usual: Usual, among: np.ndarray | None = None) -> np.ndarray:
    """Coefficients (WIDEST,) that a channel asks for, one column after another; zero for the others.

    among (WIDEST,): the columns that may be asked for; all by default.
    """
    cells = [c for c in half.cells if c.channel == channel]
    found = np.zeros(WIDEST)
    if not cells:
        return found
    allowed = [k for k in range(cells[0].free) if among is None or among[k]]
    left = [half.values[c.own] for c in cells]
    for _ in range(ROUNDS):  # of weights
        normal, right = _shared_system(half, cells, left, usual)
        free = _worth_asking(normal, right, allowed)
        found = np.zeros(WIDEST)
        found[free] = np.linalg.solve(normal[np.ix_(free, free)], right[free])
        left = [half.without(c, found, usual)[0] for c in cells]
    return found


def _shared_system(half: HalfResiduals, cells: Sequence[Cell], left: Sequence[np.ndarray], usual: Usual,
                   ) -> tuple[np.ndarray, np.ndarray]:
    """Normal matrix and right-hand side of the coefficients that all flights share, each flight's own solved for.

    left: what earlier coefficients leave of each cell.
    """
    n = cells[0].free
    total, right = np.zeros((n, n)), np.zeros(n)
    for cell, rest in zip(cells, left, strict=True):
        normal, slope = half.system(cell, half.values[cell.own], rest)
        ridge = normal + np.diag(cell.precision(usual))
        own = np.linalg.solve(ridge, np.column_stack([normal[:, :n], slope]))
        total += normal[:n, :n] - normal[:n] @ own[:, :n]
        right += slope[:n] - normal[:n] @ own[:, n]
    return total + np.diag(1e-9 * np.diag(total) + 1e-12), right


def _worth_asking(normal: np.ndarray, right: np.ndarray, allowed: Sequence[int]) -> list[int]:
    """Columns that gain more than CHANCE one after another, the best first; at most MOST_COLUMNS."""
    free: list[int] = []
    gain = 0.0
    while len(free) < MOST_COLUMNS:
        tried = [(_gain(normal, right, [*free, k]), k) for k in allowed if k not in free]
        if not tried or max(tried)[0] - gain < CHANCE:
            break
        gain, k = max(tried)
        free.append(k)
    return free


def _gain(normal: np.ndarray, right: np.ndarray, free: Sequence[int]) -> float:
    return 0.5 * float(right[free] @ np.linalg.solve(normal[np.ix_(free, free)], right[free]))


def linear_gain(half: HalfResiduals, channel: int, found: np.ndarray, usual: Usual) -> float:
    """Log likelihood that the coefficients (WIDEST,) of a channel, found elsewhere, gain on a half."""
    if not found.any():
        return 0.0
    nothing = np.zeros(WIDEST)
    return float(gain_at_even_odds(sum(half.without(c, found, usual)[1] - half.without(c, nothing, usual)[1]
                                       for c in half.cells if c.channel == channel)))


def usual_columns(halves: Sequence[HalfResiduals]) -> np.ndarray:
    """rms (CHANNELS, WIDEST) of the coefficients of nominal flights, two or more, beyond what chance alone gives."""
    n = len(halves)
    columns, surprise = np.zeros((2, CHANNELS, WIDEST))
    for h in halves:
        for cell in h.cells:
            found, variance = _one_by_one(h, cell)
            columns[cell.channel, :cell.free] += (found ** 2 - variance) / (n - 1)
            surprise[cell.channel, :cell.free] += found ** 2 / variance / n
    columns[surprise < 1.0 + SURE * np.sqrt(2.0 / n)] = 0.0
    few = (n + 1) / (n - 1)  # another flight may lie farther off than those that are known
    return np.sqrt(np.maximum(few * columns, 0.0))


def _one_by_one(half: HalfResiduals, cell: Cell) -> tuple[np.ndarray, np.ndarray]:
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
