"""The sum that every likelihood is made of, compiled: one pass over the values, and one logarithm for many of them."""

import numpy as np
from numba import boolean, float64, njit

_COLUMN = float64[::1]
LEAST, MOST = 1e-100, 1e100  #: of a product of values before its logarithm is taken


@njit(float64(_COLUMN, _COLUMN, _COLUMN, _COLUMN, boolean[::1]), cache=True, error_model="numpy")
def tailed(size, power, tail, falls, known):
    """Sum of log(power) + falls log(1 + size / power / tail) over those values (n,) that are known.

    It is minus the log likelihood, but for a constant, of values of this squared size where this power is expected.
    Sums of logarithms are logarithms of products; what the addition rounds off is carried along (Kahan).
    """
    total, lost = 0.0, 0.0
    powers, rises, fall = 1.0, 1.0, 0.0
    for i in range(len(size)):
        if not known[i]:
            continue
        if falls[i] != fall or not (powers > LEAST and powers < MOST and rises < MOST):
            term = np.log(powers) + fall * np.log(rises) - lost
            new = total + term
            lost = (new - total) - term
            total = new
            powers, rises, fall = 1.0, 1.0, falls[i]
        powers *= power[i]
        rises *= 1.0 + size[i] / (power[i] * tail[i])
    return total + (np.log(powers) + fall * np.log(rises) - lost)
