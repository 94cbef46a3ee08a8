"""The parameters of an effect, with their errors, from the strength that its class has in a flight.

A class's strength is a length in the space of features. What that is in the effect's own units comes from simulated
flights that the class was not learned from (calibration), and so does the error of a single flight.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from airtouch.gap.signatures.signature import signature_of
from airtouch.gap.signatures.term import neutral_of, parameter_of, unit
from airtouch.simulation.effects import Effect

#: standard deviation, in the log strength, of the weights of calibration flights; chosen. A larger number averages more
#: flights and follows a bend of the relation less
KERNEL_WIDTH = float(np.log(2.0))
#: flights that say that amount and strength are proportional, for strengths at the ends of the calibration; chosen. A
#: larger number holds the local line closer to that
RIDGE = 0.1
#: fraction of the calibration flights with a strength of one sign whose amounts must be of one sign, so that a strength
#: shows that of the amount; chosen. A larger number leaves more signs open
LEAST_SIGN_AGREEMENT = 0.9
LINE_COEFFICIENTS = 2.0  #: degrees of freedom that a local line uses up: intercept and slope


class Reading(NamedTuple):
    """A parameter as the relations of signals show it: its value and standard deviation, in its unit."""

    value: float
    deviation: float


class Amounts(NamedTuple):
    """Amounts (k,) of the parameters of an effect, and their standard deviations (k,).

    An amount is counted in natural steps from neutral; of a factor it is the logarithm (`amount_of`).
    """

    value: np.ndarray
    deviation: np.ndarray


@dataclass(frozen=True)
class Readout:
    """Calibration flights of one class.

    parameters: names of the k parameters that were drawn; strength (n, s): of the class, fitted to each flight;
    amount (n, k): true parameters, in natural steps from neutral, of factors the logarithm.
    """

    parameters: tuple[str, ...]
    strength: np.ndarray
    amount: np.ndarray

    def shows_sign(self, strength: np.ndarray) -> bool:
        """Whether a strength (s,), not 0, tells the sign of the amount; that of several parameters is not asked.

        A strength of a sign that no calibration flight has tells as much as one of the other sign.
        """
        if self.strength.shape[1] > 1 or self.amount.shape[1] > 1:
            return True
        same_sign = self.strength[:, 0] * strength[0] > 0.0
        positive = self.amount[same_sign if same_sign.any() else ~same_sign, 0] > 0.0
        return bool(max(positive.mean(), 1.0 - positive.mean()) >= LEAST_SIGN_AGREEMENT)

    def __call__(self, strength: np.ndarray) -> Amounts:
        """Amounts of a flight with a fitted strength (s,), not 0.

        An amount is positive where the strength does not show its sign. Raises ValueError where the strength is 0, of
        which no logarithm is.
        """
        if not np.any(strength):
            raise ValueError("a strength that is read out must not be 0")
        if self.strength.shape[1] == 1 and self.amount.shape[1] == 1:
            return self._along(float(strength[0]))
        return self._across(strength)

    def _along(self, strength: float) -> Amounts:
        """One parameter: local linear regression of the logarithm of the amount on that of the strength.

        A strength of a sign that no calibration flight has is read as the mirror image of the other sign.
        """
        same_sign = self.strength[:, 0] * strength > 0.0
        if not same_sign.any():
            mirrored = self._along(-strength)
            return mirrored._replace(value=-mirrored.value) if self.shows_sign(np.array([-strength])) else mirrored
        distance = np.log(np.abs(self.strength[same_sign, 0])) - np.log(abs(strength))
        ratio = np.log(np.abs(self.amount[same_sign, 0])) - distance
        weight = _weights(distance)
        columns = np.column_stack([np.ones_like(distance), distance])
        normal = (columns * weight[:, None]).T @ columns + RIDGE * np.diag([0.0, KERNEL_WIDTH ** 2])
        coefficients = np.linalg.solve(normal, columns.T @ (weight * ratio))
        sign = np.sign(np.median(self.amount[same_sign, 0])) if self.shows_sign(np.array([strength])) else 1.0
        amount = float(sign * np.exp(coefficients[0]))
        error = _deviation((ratio - columns @ coefficients)[:, None], weight)
        return Amounts(np.array([amount]), np.abs(amount) * error)

    def _across(self, strength: np.ndarray) -> Amounts:
        """Several parameters: linear in the strengths; errors in proportion to the length of the amount."""
        length = np.linalg.norm(self.amount, axis=1)
        matrix = np.linalg.lstsq(self.strength / length[:, None], self.amount / length[:, None], rcond=None)[0]
        amount, residual = strength @ matrix, (self.amount - self.strength @ matrix) / length[:, None]
        weight = _weights(np.log(np.linalg.norm(self.strength, axis=1)) - np.log(np.linalg.norm(strength)))
        return Amounts(amount, np.linalg.norm(amount) * _deviation(residual, weight))


def _weights(distance: np.ndarray) -> np.ndarray:
    """Weights (n,) of calibration flights at distances (n,) in the logarithm of the strength.

    They fall with the distance as a normal density does; from a strength beyond the calibration the nearest flight is
    taken to be KERNEL_WIDTH away.
    """
    beyond = max(float(np.abs(distance).min()) - KERNEL_WIDTH, 0.0)
    return np.exp(-0.5 * (np.clip(np.abs(distance) - beyond, 0.0, None) / KERNEL_WIDTH) ** 2)


def _deviation(residual: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Standard deviation (k,) of residuals (n, k) with weights (n,), less LINE_COEFFICIENTS degrees of freedom."""
    effective = weight.sum() ** 2 / (weight ** 2).sum()  # number of flights, Kish 1965
    freedom = max(effective - LINE_COEFFICIENTS, 1.0)
    variance = (weight[:, None] * residual ** 2).sum(axis=0) / weight.sum() * effective / freedom
    return np.sqrt(variance)


def amount_of(effect: Effect, name: str, value: float) -> float:
    """A parameter's value in natural steps from neutral; of a factor its logarithm."""
    if signature_of(effect).factors:
        return float(np.log(value))
    p = parameter_of(effect, name)
    return (value - neutral_of(p)) / unit(p)


def read_out(readout: Readout, effect: Effect, strength: np.ndarray) -> dict[str, Reading]:
    """The parameters of an effect, by name, whose class has a strength (s,) in a flight."""
    return {name: _reading(effect, name, float(amount), float(deviation))
            for name, amount, deviation in zip(readout.parameters, *readout(strength), strict=True)}


def _reading(effect: Effect, name: str, amount: float, deviation: float) -> Reading:
    """A parameter in its unit, from its amount and the standard deviation of that; undoes `amount_of`."""
    if signature_of(effect).factors:
        value = float(np.exp(amount))
        return Reading(value, value * deviation)
    p = parameter_of(effect, name)
    return Reading(neutral_of(p) + amount * unit(p), deviation * unit(p))
