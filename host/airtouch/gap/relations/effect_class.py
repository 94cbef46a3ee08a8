"""What an effect does to the features: a curve along its strength, and how far single flights lie off it.

Coordinates (Q of them) are those of `feature_space`: nominal flights have the covariance 1 there, so that the length of
a shift is in nominal standard deviations. A strength, in units of the class, has a magnitude and for several parameters
a direction. A class is learned from pairs of simulated flights, the same seeds with and without the effect. Thresholds
without another source were chosen on flights of `learning.SEED` (host/docs/looks.md, 2026-11-24 12:43 UTC).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from airtouch.gap.relations.readout import Readout
from airtouch.gap.signatures.random_draws import own_parameter

SMALLEST = 1e-300  #: least divisor and least argument of a logarithm, to which a 0 is raised; chosen, below any number
#: factor of strength between two knots of a curve. A larger number bends curves less, a smaller one needs more flights
KNOT_FACTOR = 3.0
KNOT = float(np.log(KNOT_FACTOR))
#: nominal deviations; a flight whose shift along the class's main direction is shorter says nothing of the curve. A
#: larger number leaves out more of the weakest flights
LEAST_SHIFT = 0.5
#: nominal deviations; errors of the curve count relative to the length of the shift, but not of a shorter one. A larger
#: number fits the curve more to strong flights
LEAST_WEIGHT_LENGTH = 5.0
#: nominal deviations; flights with a longer shift show the scatter about the curve, as it is larger than that of
#: nominal flights there; where less than half of the flights have one, the longer half. A larger number takes it from
#: fewer
LEAST_SCATTER_LENGTH = 40.0
#: distance of a flight from the curve over the median distance, above which it is an outlier that hit something. A
#: larger number lets outliers bend the curve
OUTLIER_RATIO = 4.0
#: fraction of flights with a negative strength above which a class has two signs. A larger number holds more classes
#: for one-sided
LEAST_NEGATIVE_FRACTION = 0.1
MOST_AXES = 16  #: directions of the scatter that are stored, the widest ones. A larger number makes a larger file
#: quantile of the strengths at which the curve begins: a few flights of the weakest show next to nothing. A larger
#: number begins it at stronger flights
FIRST_KNOT_QUANTILE = 0.01
#: nominal deviations; a shift of this length or longer has the full weight in the main direction. A larger number gives
#: weak flights less weight in it
FULL_WEIGHT_LENGTH = 3.0
FIT_ROUNDS = 2  #: fits of a curve: of all flights, then without outliers. More leave out more flights
#: singular values of a curve's equations over the largest one, below which they count as 0. A larger number makes parts
#: of the curve that few flights show smaller
CURVE_RCOND = 1e-6
#: flights for each coefficient of a coordinate of the curve, at least: with fewer the curve has fewer knots, and with
#: one it would pass through every flight; chosen
FLIGHTS_PER_COEFFICIENT = 2
GRID_PER_KNOT = 6  #: strengths for each knot at which a class of one parameter is tried first. More cost time
#: a direction counts as scatter if its eigenvalue is more than this times the largest one that noise alone gives
#: (Marchenko and Pastur 1967, for infinitely many samples). A larger number finds fewer directions
EIGENVALUE_MARGIN = 1.2


@dataclass(frozen=True)
class ClassCalibration:
    """What `calibration` measures of a class on flights that it was not learned from; by default nothing.

    readout: what its strengths are in the effect's units; None where too few flights show the effect.
    The others are shares, which are fractions of the evidence for the class. nameless_share, second_share: what a
    nameless disturbance, or a second effect, gains beside the class; four of five flights with it have at most so much.
    distance_scatter: standard deviation of a flight's excess distance from the class (`Library.excess`), without the
    part that nominal flights have too (`Library.excess_deviation` adds both).
    """

    readout: Readout | None = None
    nameless_share: float = 0.0
    second_share: float = 0.0
    distance_scatter: float = 0.0


@dataclass(frozen=True)
class EffectClass:
    """One class: the expected shift as a curve along the strength, and the scatter of single flights about it.

    name: of the kind of effect; effect: of the registry; shape: value of the parameter that shapes it, or None.
    parameters: number of them; signed: whether strengths have two signs.
    knots (k,): logarithms of strengths; table (parts, k, Q): shift per unit of strength at the knots, one part for each
    parameter and one more, even in the sign, where there are two signs.
    axes (Q, r), variances (r,): directions of a flight's distance from the curve, and variances along them, over the
    squared length of the shift.
    """

    name: str
    effect: str
    shape: float | None
    parameters: int
    signed: bool
    knots: np.ndarray
    table: np.ndarray
    axes: np.ndarray
    variances: np.ndarray
    calibration: ClassCalibration = ClassCalibration()

    @property
    def own_parameter(self) -> str | None:
        """The effect's parameter that the class is of, where each has a class of its own; else None."""
        return own_parameter(self.effect, self.name)

    @property
    def least(self) -> float:
        """The least strength that was flown, in units of the class."""
        return float(np.exp(self.knots[0]))

    @property
    def most(self) -> float:
        """The highest strength that was flown, in units of the class."""
        return float(np.exp(self.knots[-1]))

    def mean(self, strength: np.ndarray) -> np.ndarray:
        """Expected shift (n, Q) at strengths (n, parameters), in units of the class."""
        parts, hats = _parts(strength, self.signed), _hats(_magnitude(strength), self.knots)
        together = parts[:, :, None] * hats[:, None]
        return together.reshape(len(strength), -1) @ self.table.reshape(together[0].size, -1)

    @cached_property
    def grid(self) -> "StrengthGrid":
        """Strengths of a class with one parameter, GRID_PER_KNOT a knot, from the least to the highest."""
        steps = GRID_PER_KNOT * (len(self.knots) - 1) + 1
        one = np.exp(np.linspace(self.knots[0], self.knots[-1], steps))
        strength = np.concatenate([one, -one] if self.signed else [one])[:, None]
        return StrengthGrid(strength, self.mean(strength))


class StrengthGrid(NamedTuple):
    """Strengths (n, 1) and the expected shifts (n, Q) there."""

    strengths: np.ndarray
    shifts: np.ndarray


def _magnitude(strength: np.ndarray) -> np.ndarray:
    """Magnitudes (n,) of strengths (n, parameters)."""
    return np.abs(strength[:, 0]) if strength.shape[1] == 1 else np.linalg.norm(strength, axis=1)


def _parts(strength: np.ndarray, signed: bool) -> np.ndarray:
    """What multiplies each part of a curve (n, parts)."""
    return np.column_stack([strength, _magnitude(strength)]) if signed else strength


def _hats(magnitude: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Weights (n, k) of the knots at magnitudes (n,): straight lines in the logarithm, constant outside."""
    x = np.minimum(np.maximum(np.log(np.maximum(magnitude, SMALLEST)), knots[0]), knots[-1])
    lower_knot = np.minimum(np.maximum(np.searchsorted(knots, x) - 1, 0), len(knots) - 2)
    upper = (x - knots[lower_knot]) / (knots[lower_knot + 1] - knots[lower_knot])
    out = np.zeros((len(x), len(knots)))
    place = np.arange(len(x))
    out[place, lower_knot], out[place, lower_knot + 1] = 1.0 - upper, upper
    return out


class ClassFlights(NamedTuple):
    """Flights with an effect, each beside the same flight without it.

    amount (n, parameters): true parameters, scaled, or the strengths that they have; shift (n, Q): from the flight
    without the effect; coordinates (n, Q): of the flight itself, less the nominal mean.
    """

    amount: np.ndarray
    shift: np.ndarray
    coordinates: np.ndarray

    def chosen(self, which: np.ndarray) -> "ClassFlights":
        """Some of the flights. which (n,): bool."""
        return ClassFlights(*(values[which] for values in self))


def learn_class(name: str, effect: str, shape: float | None, flights: ClassFlights, least_flights: int = 2,
                ) -> EffectClass | None:
    """A class from flights of it; name, effect, shape: as `EffectClass` has them.

    It is None where fewer than `least_flights` show the effect, or all of them at one strength. With one parameter the
    strength is the shift along the class's main direction: what else of a flight makes the effect stronger or weaker (a
    battery's charge, the phase of four rotors) counts as its strength.
    """
    amount = flights.amount
    if amount.shape[1] == 1:
        strength = _along_main_direction(flights.shift, np.sign(amount[:, 0]))
        flights = flights._replace(amount=strength[:, None]).chosen(np.abs(strength) > LEAST_SHIFT)
    else:
        flights = flights._replace(amount=amount / np.median(np.abs(amount[amount != 0.0])))
    if len(flights.amount) < least_flights:
        return None
    learned = None
    for _ in range(FIT_ROUNDS):
        fitted = _fitted(name, effect, shape, flights)
        if fitted is None:
            return None
        learned, near = fitted
        flights = flights.chosen(near)
    return learned


def _along_main_direction(shift: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Shifts (n, Q) along the direction in which most of them lie (n,); positive where sign (n,), the effect's, is."""
    unit = shift / np.maximum(np.linalg.norm(shift, axis=1, keepdims=True), FULL_WEIGHT_LENGTH) * sign[:, None]
    direction = np.linalg.svd(unit, full_matrices=False)[2][0]
    return shift @ (direction * np.sign((unit @ direction).sum()))


def _fitted(name: str, effect: str, shape: float | None, flights: ClassFlights,
            ) -> tuple[EffectClass, np.ndarray] | None:
    """The class of flights whose amounts are strengths, and which of them lie about its curve as most do, bool (n,).

    None where all strengths are of one magnitude: a curve along the strength needs two.
    """
    strength, shift, coordinates = flights
    magnitude = np.linalg.norm(strength, axis=1)
    signed = bool((strength < 0.0).mean() > LEAST_NEGATIVE_FRACTION)
    low, high = np.log(np.quantile(magnitude, [FIRST_KNOT_QUANTILE, 1.0]))
    if not high > low:
        return None
    parts = _parts(strength, signed)
    most_knots = len(strength) // (FLIGHTS_PER_COEFFICIENT * parts.shape[1])
    knots = np.linspace(low, high, max(min(int(np.ceil((high - low) / KNOT)) + 1, most_knots), 2))
    columns = (parts[:, :, None] * _hats(magnitude, knots)[:, None]).reshape(len(strength), -1)
    weight = 1.0 / np.maximum(np.linalg.norm(shift, axis=1), LEAST_WEIGHT_LENGTH)
    table = np.linalg.lstsq(columns * weight[:, None], shift * weight[:, None], rcond=CURVE_RCOND)[0]
    expected = columns @ table
    length = np.linalg.norm(expected, axis=1)
    distance = np.linalg.norm(shift - expected, axis=1) / np.hypot(length, LEAST_WEIGHT_LENGTH)
    near = distance <= OUTLIER_RATIO * np.median(distance)
    axes, variances = _scatter(coordinates[near] - expected[near], length[near], columns.shape[1])
    table = table.reshape(parts.shape[1], len(knots), -1)
    return EffectClass(name, effect, shape, parameters=strength.shape[1], signed=signed, knots=knots, table=table,
                       axes=axes, variances=variances), near


def _scatter(residual: np.ndarray, length: np.ndarray, coefficients: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions (Q, r), and variances (r,) along them, of flights about their curve, over the squared shift.

    residual (n, Q): flights less their expected shift, of this length (n,); what nominal flights scatter is not
    counted. coefficients: number of those that each coordinate of the curve was fitted with.
    """
    clear = length >= min(float(np.median(length)), LEAST_SCATTER_LENGTH)
    relative = residual[clear] / length[clear, None]
    samples = len(relative)
    noise = float(np.mean(length[clear] ** -2.0))
    freedom = max(samples - coefficients * clear.mean(), 1.0)
    _, deviation, axes = np.linalg.svd(relative / np.sqrt(freedom), full_matrices=False)
    beyond = stands_out(deviation ** 2, noise, residual.shape[1], samples)
    beyond[MOST_AXES:] = False
    return axes[beyond].T, deviation[beyond] ** 2 - noise


def stands_out(variance: np.ndarray, noise: float, dimensions: int, samples: int) -> np.ndarray:
    """Which eigenvalues (r,) of a covariance exceed what noise of this variance gives, bool (r,).

    samples: number of those of which the covariance is; dimensions: of each.
    """
    return variance > EIGENVALUE_MARGIN * noise * (1.0 + np.sqrt(dimensions / samples)) ** 2
