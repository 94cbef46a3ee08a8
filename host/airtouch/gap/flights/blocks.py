"""Blocks of a flight, half overlapping, the Hann window under which their spectra are taken, and their bands."""

import functools

import numpy as np
from scipy.special import digamma

from airtouch.gap.flights.flight import PERIOD_S

#: Edges of the bands in which a spectrum is judged: about octaves, no other source. The lowest band has the means, the
#: last edge lies beyond half the log's rate, 50 Hz, which it so includes. They are not quite the bands of the map
#: (`where.filter_bank.MAP_BANDS_HZ`): that has filters, which cross over at 0.5 Hz; a spectrum has bins, in the air
#: 0.39 Hz apart, and 0.6 Hz lies between the second and the third.
BANDS_HZ = (0.0, 0.6, 2.0, 6.0, 12.0, 25.0, 50.1)


def half_overlapping(may_begin: np.ndarray, length: int) -> np.ndarray:
    """First samples (blocks,) of blocks of a length, each as early as it may begin half a block after the last.

    may_begin: bool, whether a block may begin there, for each sample that has a block's length behind it.
    """
    first, k = [], 0
    while k < len(may_begin):
        if may_begin[k]:
            first.append(k)
            k += length // 2
        else:
            k += 1
    return np.array(first, int)


def count_within(marked: np.ndarray, length: int) -> np.ndarray:
    """Number of marked samples, bool (n,), in each block of a length that the samples hold, by its first sample."""
    total = np.cumsum(np.concatenate([[0], marked]))
    return total[length:] - total[:-length]


@functools.cache
def hann_window(length: int) -> tuple[np.ndarray, float]:
    """A Hann window (length, 1), and what makes of a spectrum under it one of unit/sqrt(Hz)."""
    window = np.hanning(length + 1)[:-1]
    return window[:, None], np.sqrt(2.0 * PERIOD_S / (window ** 2).sum())


def log_bias(blocks: np.ndarray) -> np.ndarray:
    """What the logarithm of a mean of so many powers is expected to lie off that of the power: digamma(n) - log(n).

    The powers of a bin in different blocks are exponential and nearly independent: half overlapping Hann blocks share
    1/36 of their power's variance. Below 0: about -1 / (2 n). blocks (...): n of each mean, 1 at least.
    """
    return digamma(blocks) - np.log(blocks)
