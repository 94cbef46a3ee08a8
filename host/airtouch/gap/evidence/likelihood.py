"""Likelihood of spectra of which some power is expected: Whittle's, with tails for a floor that is not known exactly.

A value's power over the expected one is exponential when a hypothesis holds (Whittle 1953). As the floor is estimated
from few flights, the exponential is replaced by a law with heavier tails, like Student's. The sum that every likelihood
is made of is compiled: one pass over the values, and one logarithm for many of them.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import boolean, float64, njit
from scipy.optimize import brentq
from scipy.special import exp1

from airtouch.gap.signals.spectra import OVERLAP_WEIGHT, squared

#: most degrees of freedom of the tails in the replay view; chosen: those of four blocks, three each
#: (`flattened.FREEDOM_OF_BLOCK`). A larger number has lighter tails, so that single loud blocks count as evidence
REPLAY_FREEDOM = 12.0
#: bounds of the running products in `minus_log_likelihood`: one that leaves them is replaced by 1, and its logarithm is
#: added to the sum; chosen. Closer bounds take more logarithms, wider ones let products under- or overflow
LEAST_PRODUCT, LARGEST_PRODUCT = 1e-100, 1e100
#: bounds of the root that `tail_scale` looks for; chosen. The root lies between them for all degrees of freedom in use;
#: above 709 the exponential in it overflows
LEAST_TAIL_SCALE, LARGEST_TAIL_SCALE = 1e-3, 600.0
_COLUMN = float64[::1]  #: Numba's type of a contiguous array of numbers


class PowerSlopes(NamedTuple):
    """Slope (n,) of the log likelihood of each of n values by its expected power; curvature (n,), never negative.

    Slope in nats per unit^2/Hz; curvature: minus the second derivative that is expected, in nats per its square.
    """

    slope: np.ndarray
    curvature: np.ndarray


@dataclass(frozen=True)
class Likelihood:
    """Log likelihood of a residual, nats; only differences mean something.

    floor_power (n,): expected without effects, unit^2/Hz; freedom, tail_scale (n,): degrees of freedom and scale of the
    tails; valid (n,): bool, which values count. In its functions extra_power (n,) is what a hypothesis adds.
    """

    floor_power: np.ndarray
    freedom: np.ndarray
    tail_scale: np.ndarray
    valid: np.ndarray

    def __call__(self, residual: np.ndarray, extra_power: np.ndarray | float = 0.0) -> float:
        """Log likelihood of a residual (n,)."""
        size, expected_power = squared(residual), self.floor_power + extra_power
        return -OVERLAP_WEIGHT * minus_log_likelihood(size, expected_power, self.tail_scale, self.exponent, self.valid)

    def per_value(self, residual: np.ndarray, extra_power: np.ndarray | float = 0.0) -> np.ndarray:
        """Log likelihood (n,) of each value, 0 for those that do not count."""
        levels = _levels(squared(residual), self.floor_power + extra_power, self.tail_scale, self.exponent)
        levels[~self.valid] = 0.0
        return levels

    def along(self, size: np.ndarray, extra_power: np.ndarray, direction: np.ndarray) -> Callable[[float], float]:
        """Log likelihood as a function of x where the extra power is extra_power + x * direction, (n,) each.

        Only values whose power changes are computed anew. size (n,): |residual|^2.
        """
        changing = (direction != 0.0) & self.valid
        at_0, tail_scale, exponents = self.floor_power + extra_power, self.tail_scale, self.exponent
        rest = minus_log_likelihood(size, at_0, tail_scale, exponents, self.valid & ~changing)
        size_there, direction_there, at_0, tail_scale, exponents, valid = (
            v[changing] for v in (size, direction, at_0, tail_scale, exponents, self.valid))

        def at(x: float) -> float:
            """Log likelihood at x."""
            there = minus_log_likelihood(size_there, at_0 + x * direction_there, tail_scale, exponents, valid)
            return -OVERLAP_WEIGHT * (rest + there)

        return at

    def power_slopes(self, residual: np.ndarray, extra_power: np.ndarray, count: int) -> PowerSlopes:
        """Slope and curvature by the expected power of each of the first `count` values.

        The curvature is what is expected of the law without tails (Whittle's). It is larger than that of the law with
        tails, nu / (nu + 2) of it, by (nu + 2) / nu; so errors of effects that it gives are smaller by up to the root
        of that. nu: the degrees of freedom.
        """
        first = slice(count)
        expected_power = self.floor_power[first] + extra_power[first]
        over_expected = squared(residual[first]) / expected_power
        per_power = OVERLAP_WEIGHT * self.valid[first] / expected_power
        counted = self.exponent[first] * over_expected / (self.tail_scale[first] + over_expected)
        return PowerSlopes(per_power * (counted - 1.0), per_power / expected_power)

    @functools.cached_property
    def exponent(self) -> np.ndarray:
        """Exponent nu + 1 (n,) of the tails (1 + e / tail_scale)^-(nu + 1).

        e: a value's power over that expected; nu: the degrees of freedom.
        """
        return self.freedom + 1.0


def _levels(size: np.ndarray, expected_power: np.ndarray, tail_scale: np.ndarray, exponents: np.ndarray) -> np.ndarray:
    """Log likelihood (n,) of values of a squared size; it overwrites the expected power."""
    tails = size / expected_power
    tails /= tail_scale
    np.log1p(tails, out=tails)
    tails *= exponents
    levels = np.log(expected_power, out=expected_power)
    levels += tails
    levels *= -OVERLAP_WEIGHT
    return levels


def tail_scale(freedom: np.ndarray) -> np.ndarray:
    """Scale (n,) of tails whose likelihood is highest at the mean of exponential power.

    E[(nu + 1) e / (tail_scale + e)] = 1, where e is exponential and nu are the degrees of freedom (n,).
    """
    different, inverse = np.unique(freedom, return_inverse=True)
    return np.array([_tail_scale(nu) for nu in different])[inverse] if len(freedom) else freedom


@functools.cache
def _tail_scale(nu: float) -> float:
    """`tail_scale` for one number nu of degrees of freedom: the scale a of a e^a E1(a) = nu / (nu + 1)."""
    return float(brentq(lambda a: a * np.exp(a) * exp1(a) - nu / (nu + 1.0), LEAST_TAIL_SCALE, LARGEST_TAIL_SCALE))


@njit(float64(_COLUMN, _COLUMN, _COLUMN, _COLUMN, boolean[::1]), cache=True, error_model="numpy")
def minus_log_likelihood(size, power, tail_scale, exponents, valid):
    """Sum of log(power) + exponent log(1 + size / power / tail_scale) over those values (n,) that are valid, nats.

    It is minus the log likelihood, but for a constant and for OVERLAP_WEIGHT, of values of this squared size; power:
    the expected one; where `tail_scale` is the exponent less 1, that is `loop.command_spectra.log_likelihood`.
    Sums of logarithms are logarithms of products; what the addition rounds off is carried along (Kahan).
    """
    total, lost = 0.0, 0.0
    powers, over, exponent = 1.0, 1.0, 0.0
    for i in range(len(size)):
        if not valid[i]:
            continue
        within = powers > LEAST_PRODUCT and powers < LARGEST_PRODUCT and over < LARGEST_PRODUCT
        if exponents[i] != exponent or not within:
            term = np.log(powers) + exponent * np.log(over) - lost
            new = total + term
            lost = (new - total) - term
            total = new
            powers, over, exponent = 1.0, 1.0, exponents[i]
        powers *= power[i]
        over *= 1.0 + size[i] / (power[i] * tail_scale[i])
    return total + (np.log(powers) + exponent * np.log(over) - lost)
