"""The regression of a hypothesis's residual, fitted to one half of the data and judged on the other."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.problem import BlockSet, problem_of
from airtouch.gap.nameless.columns import CHANNELS, WIDEST, NamelessFloor, Regressors, no_floor, regressors_of
from airtouch.gap.nameless.powers import Powers, gain_at_even_odds
from airtouch.gap.signals.spectra import OVERLAP_WEIGHT, squared
from airtouch.gap.signatures.term import Term

REWEIGHTINGS = 3  #: iterations of the weights of a fit of the columns that flights share; chosen
OWN_ROUNDS = 2  #: the same of one channel of a flight under fitted coefficients; chosen
RIDGE, LEAST_RIDGE = 1e-9, 1e-12  #: added to a normal matrix, over its diagonal and at least, to invert it; chosen
MOST_COLUMNS = 4  #: columns of one channel that may be used; chosen
SURE = 3.0  #: standard deviations by which coefficients must scatter more than by chance; chosen
CHANCE = 4.0  #: nats that a column must gain on the half that it is fitted to; chosen, chance gives about one


class PartResiduals:
    """Residual of a part of the flights under a hypothesis: values, their expected power, and the basis there.

    regressors: of every channel of every flight; what nominal flights may have of a column, each flight has for itself.
    """

    def __init__(self, data: Data, part: BlockSet, terms: Sequence[Term]) -> None:
        self.problem = problem = problem_of(data, part)
        modelled = problem.modelled(terms)
        self.values, self.power = modelled.gap, problem.elements.power + modelled.extra_power
        self.cells = problem.flat.cells
        self.regressors = regressors_of(data, part, problem)

    def normal_equations(self, regressors: Regressors, values: np.ndarray, residual: np.ndarray,
                         ) -> tuple[np.ndarray, np.ndarray]:
        """Normal matrix (columns, columns) and right-hand side (columns,) of one channel of one flight.

        values (elements,): to which its columns are fitted; residual (elements,): by which each is weighted, as its
        tails are Student's.
        """
        places = regressors.places
        elements, power = self.problem.elements, self.power[places]
        nu, tail_scale = elements.freedom[places], elements.tail_scale[places]
        weights = OVERLAP_WEIGHT * (nu + 1.0) / (tail_scale + squared(residual) / power) / power
        weighted = regressors.columns.conj().T * weights
        return 2.0 * (weighted @ regressors.columns).real, 2.0 * (weighted @ values).real

    def residual_under(self, regressors: Regressors, fitted: np.ndarray, floor: NamelessFloor,
                       ) -> tuple[np.ndarray, float]:
        """Residual (elements,) of one channel of one flight under fitted coefficients, and its log likelihood.

        What nominal flights may have of the columns is taken off as well. fitted (columns,): the coefficients that all
        flights share.
        """
        values = self.values[regressors.places] - regressors.columns[:, :regressors.free] @ fitted[:regressors.free]
        residual, precision = values, regressors.precision(floor)
        for _ in range(OWN_ROUNDS):
            normal, right = self.normal_equations(regressors, values, residual)
            x = np.linalg.solve(normal + np.diag(precision), right)
            residual = values - regressors.columns @ x
        elements, places = self.problem.elements, regressors.places
        over_expected = squared(residual) / self.power[places]
        tails = (elements.freedom[places] + 1.0) * np.log1p(over_expected / elements.tail_scale[places])
        return residual, -float(OVERLAP_WEIGHT * tails.sum() + 0.5 * (precision * x ** 2).sum())

    def powers(self, residuals: np.ndarray) -> Powers:
        """Powers of the residuals (elements,) whose values are valid."""
        elements = self.problem.elements
        valid = elements.valid
        over = squared(residuals[valid]) / self.power[valid]
        return Powers(over, elements.freedom[valid], elements.tail_scale[valid], self.cells[valid])

    def residuals_under(self, fitted: np.ndarray, floor: NamelessFloor) -> np.ndarray:
        """`residual_under` of every channel of every flight, (elements,). fitted (CHANNELS, WIDEST): coefficients."""
        residuals = self.values.copy()
        for regressors in self.regressors:
            residuals[regressors.places], _ = self.residual_under(regressors, fitted[regressors.channel], floor)
        return residuals

    def floor_powers(self, floor: NamelessFloor) -> Powers:
        """`powers` without what nominal flights may have of the columns."""
        return self.powers(self.residuals_under(np.zeros((CHANNELS, WIDEST)), floor))


def coefficients(part: PartResiduals, channel: int, floor: NamelessFloor, among: np.ndarray | None = None,
                 ) -> np.ndarray:
    """Coefficients (WIDEST,) that a channel asks for, one column after another; zero for the others.

    among (WIDEST,): the columns that may be asked for; all by default.
    """
    sets = [c for c in part.regressors if c.channel == channel]
    fitted = np.zeros(WIDEST)
    if not sets:
        return fitted
    allowed = [k for k in range(sets[0].free) if among is None or among[k]]
    residuals = [part.values[c.places] for c in sets]
    for _ in range(REWEIGHTINGS):
        normal, right = _shared_system(part, sets, residuals, floor)
        free = _selected_columns(normal, right, allowed)
        fitted = np.zeros(WIDEST)
        fitted[free] = np.linalg.solve(normal[np.ix_(free, free)], right[free])
        residuals = [part.residual_under(c, fitted, floor)[0] for c in sets]
    return fitted


def _shared_system(part: PartResiduals, sets: Sequence[Regressors], residuals: Sequence[np.ndarray],
                   floor: NamelessFloor) -> tuple[np.ndarray, np.ndarray]:
    """Normal matrix and right-hand side of the coefficients that all flights share, each flight's own solved for.

    residuals: of each of the sets of regressors under earlier coefficients.
    """
    n = sets[0].free
    total, right = np.zeros((n, n)), np.zeros(n)
    for regressors, residual in zip(sets, residuals, strict=True):
        normal, slope = part.normal_equations(regressors, part.values[regressors.places], residual)
        ridge = normal + np.diag(regressors.precision(floor))
        own = np.linalg.solve(ridge, np.column_stack([normal[:, :n], slope]))
        total += normal[:n, :n] - normal[:n] @ own[:, :n]
        right += slope[:n] - normal[:n] @ own[:, n]
    return total + np.diag(RIDGE * np.diag(total) + LEAST_RIDGE), right


def _selected_columns(normal: np.ndarray, right: np.ndarray, allowed: Sequence[int]) -> list[int]:
    """Columns that gain more than CHANCE one after another, the best first; at most MOST_COLUMNS."""
    free: list[int] = []
    gain = 0.0
    while len(free) < MOST_COLUMNS:
        gains = [(_gain_of_columns(normal, right, [*free, k]), k) for k in allowed if k not in free]
        if not gains or max(gains)[0] - gain < CHANCE:
            break
        gain, k = max(gains)
        free.append(k)
    return free


def _gain_of_columns(normal: np.ndarray, right: np.ndarray, free: Sequence[int]) -> float:
    """Nats that the free columns gain together."""
    return 0.5 * float(right[free] @ np.linalg.solve(normal[np.ix_(free, free)], right[free]))


def linear_gain(part: PartResiduals, channel: int, fitted: np.ndarray, floor: NamelessFloor) -> float:
    """Log likelihood that the coefficients (WIDEST,) of a channel, fitted elsewhere, gain on a part."""
    if not fitted.any():
        return 0.0
    nothing = np.zeros(WIDEST)
    own = [c for c in part.regressors if c.channel == channel]
    return float(gain_at_even_odds(sum(part.residual_under(c, fitted, floor)[1]
                                       - part.residual_under(c, nothing, floor)[1] for c in own)))


def column_floor(parts: Sequence[PartResiduals]) -> np.ndarray:
    """rms (CHANNELS, WIDEST) of the coefficients of nominal flights, two or more, beyond what chance alone gives."""
    n = len(parts)
    beyond_chance, over_chance = np.zeros((2, CHANNELS, WIDEST))
    for part in parts:
        for regressors in part.regressors:
            estimate, variance = _one_by_one(part, regressors)
            beyond_chance[regressors.channel, :regressors.free] += (estimate ** 2 - variance) / (n - 1)
            over_chance[regressors.channel, :regressors.free] += estimate ** 2 / variance / n
    beyond_chance[over_chance < 1.0 + SURE * np.sqrt(2.0 / n)] = 0.0
    of_another = (n + 1) / (n - 1)  # another flight may lie farther off than those that are known
    return np.sqrt(np.maximum(of_another * beyond_chance, 0.0))


def _one_by_one(part: PartResiduals, regressors: Regressors) -> tuple[np.ndarray, np.ndarray]:
    """Coefficient and variance (columns,) of every column of one channel of a flight, each beside the offsets."""
    n = regressors.free
    residual = part.residual_under(regressors, np.zeros(n), no_floor())[0]
    normal, right = part.normal_equations(regressors, part.values[regressors.places], residual)
    estimate, variance = np.zeros(n), np.zeros(n)
    for k in range(n):
        index = [k, *range(n, len(right))]
        precision = np.concatenate([[LEAST_RIDGE], 1.0 / regressors.offsets ** 2])
        inverse = np.linalg.inv(normal[np.ix_(index, index)] + np.diag(precision + RIDGE * np.diag(normal)[index]))
        estimate[k], variance[k] = (inverse @ right[index])[0], inverse[0, 0]
    return estimate, variance
