"""How far a float32 kernel may be from its float64 definition, and why so far.

A float32 number holds 24 bits, so a sum cannot be better than EPS times what
went into it, whatever is left of it in the end. Outputs that are what remains
after large terms cancel are therefore held to 1e-5 of themselves plus a few EPS of those terms.
"""

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

EPS = 2.0**-24  #: half a unit in the last place of 1, float32
RELATIVE = 1e-5
TINY = 1e-18  #: amplitudes whose square is below float32's normal range


def band_power_excess(kernel: np.ndarray, reference: np.ndarray, x: np.ndarray, window: int) -> np.ndarray:
    """Error of the amplitude sqrt(P) beyond 0.5e-5 of itself, in EPS of the window's spread.

    kernel, reference: (n, c) at hop 1, rows from window - 1 on; x: (n, c) the samples,
    finite. The spread is the largest deviation from the mean within the last two
    windows: rounding of samples lives in the sums for that long.
    """
    error = np.abs(np.sqrt(kernel.astype(np.float64)) - np.sqrt(reference))
    float64 = 1e-15 * np.abs(x).max(axis=0)  # the definition's own rounding, where a constant leaves nothing
    beyond = np.maximum(error - 0.5 * RELATIVE * np.sqrt(reference) - TINY - float64, 0.0)
    return beyond / np.maximum(EPS * spread(x, 2 * window)[window - 1:], 1e-300)


def spread(x: np.ndarray, window: int) -> np.ndarray:
    """(n, c): the range of the last `window` samples, or of all so far."""
    causal = {"size": window, "axis": 0, "mode": "nearest", "origin": window - 1 - window // 2}
    x = np.asarray(x, dtype=np.float64)
    return maximum_filter1d(x, **causal) - minimum_filter1d(x, **causal)


def deviation_power(x: np.ndarray, window: int) -> np.ndarray:
    """(n - window + 1, c): mean square deviation from the mean of each window."""
    x = x - x.mean(axis=0, dtype=np.float64)
    first, second = (np.cumsum(np.concatenate([np.zeros((1, x.shape[1])), x**k]), axis=0) for k in (1, 2))
    mean, square = ((s[window:] - s[:-window]) / window for s in (first, second))
    return np.maximum(square - mean**2, 0.0)


def worst(kernel: np.ndarray, reference: np.ndarray, scale: np.ndarray | float) -> float:
    """The largest error in units of scale; NaN must stand at the same places."""
    kernel = np.asarray(kernel, dtype=np.float64)
    assert (np.isnan(kernel) == np.isnan(reference)).all()
    return float(np.nanmax(np.abs(kernel - reference) / scale, initial=0.0))


def same_alerts(kernel: np.ndarray, reference: np.ndarray, power: np.ndarray, threshold: np.ndarray,
                resolution: np.ndarray | float = 0.0) -> bool:
    """Whether alerts agree wherever the cell is not within 1e-5 (and the resolution) of its threshold."""
    with np.errstate(invalid="ignore"):
        tie = np.abs(power - threshold) <= RELATIVE * threshold + resolution
    return bool((kernel == reference)[~tie].all())
