"""Samples that a log lacks, filled so that filters and spectra can run over them."""

import numpy as np


def interpolate_missing(values: np.ndarray) -> np.ndarray:
    """Missing samples (n,) or (n, c) filled along the flight by straight lines; 0 where all are missing."""
    out = np.array(values, dtype=np.float64)
    table = out[:, None] if out.ndim == 1 else out
    finite = np.ascontiguousarray(np.isfinite(table).T)  # NumPy is slow to ask for all of short rows
    for j in np.flatnonzero(~finite.all(axis=1)):
        table[:, j] = _bridged(table[:, j], finite[j]) if finite[j].any() else 0.0
    return out


def interpolate_over(values: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """The values (n, c) with straight lines over the samples that are not valid; absent channels stay NaN."""
    out = np.array(values)
    if not valid.all() and valid.any():
        for c in range(out.shape[1]):
            out[:, c] = _bridged(out[:, c], valid)
    return out


def _bridged(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Values (n,) with straight lines over those that are not known, bool (n,)."""
    return np.interp(np.arange(len(values)), np.flatnonzero(known), values[known])
