"""Second-order Butterworth filters that run both ways, and a first-order lag.

As `butter`, `sosfiltfilt` and `lfilter` of scipy.signal, whose import takes a second.
"""

import numpy as np
from numba import float64, njit, types

from airtouch.simulation.sensors.filters import lowpass_coefficients

_TABLE = float64[:, ::1]


def lowpass(share: float) -> np.ndarray:
    """Coefficients (6,), b0 to b2 and 1 to a2, of a low-pass; share: its frequency over half of the sampling rate."""
    b = np.zeros(5)
    lowpass_coefficients(share, 0.5, b)
    return np.array([*b[:3], 1.0, *b[3:]])


def highpass(share: float) -> np.ndarray:
    """Coefficients (6,) of a high-pass; see `lowpass`. It has the same poles, and passes half of the rate whole."""
    _, _, _, _, a1, a2 = lowpass(share)
    gain = 0.25 * (1.0 - a1 + a2)
    return np.array([gain, -2.0 * gain, gain, 1.0, a1, a2])


def both_ways(section: np.ndarray, values: np.ndarray, pad: int = 9) -> np.ndarray:
    """Values (n,) or (n, c) filtered forwards and backwards; pad: samples mirrored at each end, fewer than n."""
    table = values[:, None] if values.ndim == 1 else values
    before, after = 2.0 * table[0] - table[pad:0:-1], 2.0 * table[-1] - table[-2:-pad - 2:-1]
    longer = np.concatenate([before, table, after])
    for _ in range(2):
        _run(section, _settled(section), longer)
        longer = np.ascontiguousarray(longer[::-1])
    out = longer[pad:pad + len(table)]
    return out[:, 0] if values.ndim == 1 else out


def lagged(share: float, values: np.ndarray) -> np.ndarray:
    """Values (n, c) through a first-order lag that is at rest at 0; share: of a difference left after one sample."""
    out = np.array(values, float, order="C")
    _lag(share, out)
    return out


def _settled(section: np.ndarray) -> np.ndarray:
    """Memory (2,) of a section through which 1 has run for ever."""
    b0, b1, b2, _, a1, a2 = section
    first = ((b1 - a1 * b0) + (b2 - a2 * b0)) / (1.0 + a1 + a2)
    return np.array([first, (1.0 + a1) * first - (b1 - a1 * b0)])


@njit(types.void(float64[::1], float64[::1], _TABLE), cache=True)
def _run(section, settled, values):
    """Filter a table (n, c) in place, as if its first row had lasted for ever."""
    b0, b1, b2, a1, a2 = section[0], section[1], section[2], section[4], section[5]
    for c in range(values.shape[1]):
        one, two = settled[0] * values[0, c], settled[1] * values[0, c]
        for k in range(len(values)):
            x = values[k, c]
            y = b0 * x + one
            one = b1 * x - a1 * y + two
            two = b2 * x - a2 * y
            values[k, c] = y


@njit(types.void(float64, _TABLE), cache=True)
def _lag(share, values):
    """Lag a table (n, c) in place."""
    for c in range(values.shape[1]):
        y = 0.0
        for k in range(len(values)):
            y = (1.0 - share) * values[k, c] + share * y
            values[k, c] = y
