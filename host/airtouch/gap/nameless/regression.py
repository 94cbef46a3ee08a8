"""The regression of a hypothesis's residual on columns, fitted to one half of the data and judged on the other."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.problem import BlockSet, problem_of
from airtouch.gap.nameless.columns import CHANNELS, WIDEST, NamelessFloor, Regressors, no_floor, regressors_of
from airtouch.gap.nameless.powers import LEAST_COLUMN_GAIN, Powers, gain_at_even_odds
from airtouch.gap.signals.spectra import OVERLAP_WEIGHT, squared
from airtouch.gap.signatures.term import Term

#: iterations of the weights, of a fit of the columns that flights share and of one of a flight's own coefficients;
#: chosen. Larger numbers take more time, and the weights settle further
REWEIGHTINGS, OWN_REWEIGHTINGS = 3, 2
#: added to a normal matrix to invert it: fraction of its diagonal, and least; chosen, next to none. Larger numbers draw
#: coefficients to 0
RIDGE, LEAST_RIDGE = 1e-9, 1e-12
#: columns of one channel that are used at most; chosen. A larger number follows the flight more closely
MOST_COLUMNS = 4
#: standard errors by which the mean square of nominal flights' coefficients must exceed that of chance to count as
#: scatter; chosen. With a larger number fewer columns have any
LEAST_ERRORS = 3.0


class BlockResiduals:
    """Residual (n,) of some blocks under a hypothesis, its expected power, and its regressors.

    regressors: of every channel of every flight. Beside coefficients that flights share each flight has its own, with a
    prior as wide as nominal flights scatter.
    """

    def __init__(self, data: Data, blocks: BlockSet, terms: Sequence[Term]) -> None:
        self.problem = problem = problem_of(data, blocks)
        modelled = problem.modelled(terms)
        self.residual = modelled.residual
        self.expected_power = problem.elements.floor_power + modelled.extra_power
        self.cells = problem.flat.cells
        self.regressors = regressors_of(data, blocks, problem)

    def normal_equations(self, regressors: Regressors, target: np.ndarray, residual: np.ndarray,
                         ) -> tuple[np.ndarray, np.ndarray]:
        """Normal matrix (columns, columns) and right-hand side (columns,) of one channel of one flight.

        target (elements,): to which its columns are fitted; residual (elements,): of an earlier fit, by which each
        value is weighted, as its tails are Student's.
        """
        indices = regressors.indices
        elements, expected_power = self.problem.elements, self.expected_power[indices]
        nu, tail_scale = elements.freedom[indices], elements.tail_scale[indices]
        over_expected = squared(residual) / expected_power
        weights = OVERLAP_WEIGHT * (nu + 1.0) / (tail_scale + over_expected) / expected_power
        weighted = regressors.columns.conj().T * weights
        return 2.0 * (weighted @ regressors.columns).real, 2.0 * (weighted @ target).real

    def residual_under(self, regressors: Regressors, fitted: np.ndarray, floor: NamelessFloor,
                       ) -> tuple[np.ndarray, float]:
        """Residual (elements,) of one channel of one flight under fitted coefficients, and its log posterior, nats.

        The flight's own coefficients and offsets of highest posterior are subtracted as well. fitted (columns,): the
        coefficients that all flights share.
        """
        indices, free = regressors.indices, regressors.free
        target = self.residual[indices] - regressors.columns[:, :free] @ fitted[:free]
        residual, precision = target, regressors.precision(floor)
        for _ in range(OWN_REWEIGHTINGS):
            normal, right = self.normal_equations(regressors, target, residual)
            x = np.linalg.solve(normal + np.diag(precision), right)
            residual = target - regressors.columns @ x
        elements = self.problem.elements
        over_expected = squared(residual) / self.expected_power[indices]
        tails = (elements.freedom[indices] + 1.0) * np.log1p(over_expected / elements.tail_scale[indices])
        return residual, -float(OVERLAP_WEIGHT * tails.sum() + 0.5 * (precision * x ** 2).sum())

    def powers(self, residual: np.ndarray) -> Powers:
        """Powers of those values of a residual (n,) that are valid."""
        elements = self.problem.elements
        valid = elements.valid
        over_expected = squared(residual[valid]) / self.expected_power[valid]
        return Powers(over_expected, elements.freedom[valid], elements.tail_scale[valid], self.cells[valid])

    def whole_residual_under(self, fitted: np.ndarray, floor: NamelessFloor) -> np.ndarray:
        """Residual (n,) of all channels and flights under fitted coefficients (CHANNELS, WIDEST)."""
        residual = self.residual.copy()
        for regressors in self.regressors:
            residual[regressors.indices], _ = self.residual_under(regressors, fitted[regressors.channel], floor)
        return residual

    def floor_powers(self, floor: NamelessFloor) -> Powers:
        """Powers of the residual less each flight's own coefficients and offsets."""
        return self.powers(self.whole_residual_under(np.zeros((CHANNELS, WIDEST)), floor))


def coefficients(half: BlockResiduals, channel: int, floor: NamelessFloor, among: np.ndarray | None = None,
                 ) -> np.ndarray:
    """Coefficients (WIDEST,) of a channel by forward selection of columns (`_selected_columns`); 0 for the others.

    among (WIDEST,): which columns may be selected, bool; all by default.
    """
    sets = [c for c in half.regressors if c.channel == channel]
    fitted = np.zeros(WIDEST)
    if not sets:
        return fitted
    allowed = [k for k in range(sets[0].free) if among is None or among[k]]
    residuals = [half.residual[c.indices] for c in sets]
    for _ in range(REWEIGHTINGS):
        normal, right = _shared_system(half, sets, residuals, floor)
        free = _selected_columns(normal, right, allowed)
        fitted = np.zeros(WIDEST)
        fitted[free] = np.linalg.solve(normal[np.ix_(free, free)], right[free])
        residuals = [half.residual_under(c, fitted, floor)[0] for c in sets]
    return fitted


def _shared_system(half: BlockResiduals, sets: Sequence[Regressors], residuals: Sequence[np.ndarray],
                   floor: NamelessFloor) -> tuple[np.ndarray, np.ndarray]:
    """Normal matrix and right-hand side of the coefficients that all flights share, each flight's own eliminated.

    sets: regressors of the channel, one for each flight; residuals: of each under earlier coefficients.
    """
    n = sets[0].free
    total, right = np.zeros((n, n)), np.zeros(n)
    for regressors, residual in zip(sets, residuals, strict=True):
        normal, slope = half.normal_equations(regressors, half.residual[regressors.indices], residual)
        ridge = normal + np.diag(regressors.precision(floor))
        own = np.linalg.solve(ridge, np.column_stack([normal[:, :n], slope]))
        total += normal[:n, :n] - normal[:n] @ own[:, :n]
        right += slope[:n] - normal[:n] @ own[:, n]
    return total + np.diag(RIDGE * np.diag(total) + LEAST_RIDGE), right


def _selected_columns(normal: np.ndarray, right: np.ndarray, allowed: Sequence[int]) -> list[int]:
    """Columns that each gain LEAST_COLUMN_GAIN or more beside those before, the best first; at most MOST_COLUMNS."""
    free: list[int] = []
    gain = 0.0
    while len(free) < MOST_COLUMNS:
        gains = [(_gain_of_columns(normal, right, [*free, k]), k) for k in allowed if k not in free]
        if not gains or max(gains)[0] - gain < LEAST_COLUMN_GAIN:
            break
        gain, k = max(gains)
        free.append(k)
    return free


def _gain_of_columns(normal: np.ndarray, right: np.ndarray, free: Sequence[int]) -> float:
    """Nats that some columns gain together."""
    return 0.5 * float(right[free] @ np.linalg.solve(normal[np.ix_(free, free)], right[free]))


def linear_gain(held_out: BlockResiduals, channel: int, fitted: np.ndarray, floor: NamelessFloor) -> float:
    """Nats that coefficients (WIDEST,) of a channel, fitted elsewhere, gain on the blocks held out, at even odds."""
    if not fitted.any():
        return 0.0
    nothing = np.zeros(WIDEST)
    own = [c for c in held_out.regressors if c.channel == channel]
    return float(gain_at_even_odds(sum(held_out.residual_under(c, fitted, floor)[1]
                                       - held_out.residual_under(c, nothing, floor)[1] for c in own)))


def column_floor(flights: Sequence[BlockResiduals]) -> np.ndarray:
    """Rms (CHANNELS, WIDEST) of the coefficients of nominal flights, two or more, beyond what chance alone gives."""
    n = len(flights)
    beyond_chance, over_chance = np.zeros((2, CHANNELS, WIDEST))
    for flight in flights:
        for regressors in flight.regressors:
            estimate, variance = _one_by_one(flight, regressors)
            beyond_chance[regressors.channel, :regressors.free] += (estimate ** 2 - variance) / (n - 1)
            over_chance[regressors.channel, :regressors.free] += estimate ** 2 / variance / n
    beyond_chance[over_chance < 1.0 + LEAST_ERRORS * np.sqrt(2.0 / n)] = 0.0
    of_another = (n + 1) / (n - 1)  # another flight may lie farther off than those that are known
    return np.sqrt(np.maximum(of_another * beyond_chance, 0.0))


def _one_by_one(flight: BlockResiduals, regressors: Regressors) -> tuple[np.ndarray, np.ndarray]:
    """Coefficient and variance (columns,) of every column of one channel of a flight, each beside the offsets."""
    n = regressors.free
    residual = flight.residual_under(regressors, np.zeros(n), no_floor())[0]
    normal, right = flight.normal_equations(regressors, flight.residual[regressors.indices], residual)
    estimate, variance = np.zeros(n), np.zeros(n)
    for k in range(n):
        index = [k, *range(n, len(right))]
        precision = np.concatenate([[LEAST_RIDGE], 1.0 / regressors.offset_stds ** 2])
        inverse = np.linalg.inv(normal[np.ix_(index, index)] + np.diag(precision + RIDGE * np.diag(normal)[index]))
        estimate[k], variance[k] = (inverse @ right[index])[0], inverse[0, 0]
    return estimate, variance
