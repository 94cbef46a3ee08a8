"""Blocks of a flight, half overlapping, the window and the bands of their spectra, and how mean powers are smoothed."""

import functools

import numpy as np
from scipy.ndimage import gaussian_filter1d
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
    """Expected error of the logarithm of a mean of n powers: digamma(n) - log(n), which is below 0, about -1 / (2 n).

    The powers of a bin in different blocks are exponential and nearly independent: half overlapping Hann blocks share
    1/36 of their power's variance. blocks (...): n of each mean, 1 at least.
    """
    return digamma(blocks) - np.log(blocks)


def smooth_power(power: np.ndarray, blocks: np.ndarray, width: float) -> np.ndarray:
    """Mean powers (bins, k), each above 0, averaged over neighbouring bins in the logarithm, without its bias.

    blocks (bins, k), or a shape that spreads to it: over how many blocks each is a mean, 1 at least; width: standard
    deviation of the Gaussian, bins.
    """
    return np.exp(gaussian_filter1d(np.log(power) - log_bias(blocks), width, axis=0, mode="nearest"))
