"""How far a probability can be believed: reliability and expected calibration error."""

import numpy as np

BINS = 10  #: of equal width; Guo et al. 2017 use 15


def reliability(probability: np.ndarray, over: np.ndarray, bins: int = BINS) -> np.ndarray:
    """Reliability table of P(over), shape (bins, 3), additive over flights.

    probability: (n,) in 0..1, non-finite samples are left out. over: (n,) bool truth at the same sample; a detector's
    lag is not subtracted.
    Columns: number of samples, sum of their probabilities, number truly over;
    rows: equal-width bins, the last one closed on both sides.
    """
    known = np.isfinite(probability)
    p = np.clip(np.asarray(probability, float)[known], 0.0, 1.0)
    y = np.asarray(over, bool)[known]
    row = np.minimum((p * bins).astype(int), bins - 1)
    return np.column_stack([np.bincount(row, weights, minlength=bins) for weights in (np.ones_like(p), p, y)])


def expected_calibration_error(table: np.ndarray) -> np.ndarray:
    """ECE of reliability tables of shape (..., bins, 3): mean |confidence - frequency|, 0 to 1.

    Weighted by the bins' samples; NaN for an empty table. Source: Naeini, Cooper,
    Hauskrecht, Obtaining Well Calibrated Probabilities Using Bayesian Binning, AAAI 2015.
    """
    table = np.asarray(table, float)
    samples = table[..., 0].sum(axis=-1)
    gap = np.abs(table[..., 1] - table[..., 2]).sum(axis=-1)
    return np.divide(gap, samples, out=np.full_like(gap, np.nan), where=samples > 0)
