"""Samples that a log lacks, filled so that filters and spectra can run over them."""

import numpy as np


def interpolate_missing(values: np.ndarray) -> np.ndarray:
    """Missing samples (n,) or (n, c) filled along the flight by straight lines; 0 where all are missing."""
    out = np.array(values, dtype=np.float64)
    table = out[:, None] if out.ndim == 1 else out
    finite = np.isfinite(table)
    for j in np.flatnonzero(~finite.all(axis=0)):
        good = np.flatnonzero(finite[:, j])
        table[:, j] = np.interp(np.arange(len(table)), good, table[good, j]) if len(good) else 0.0
    return out


def interpolate_over(values: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """The values (n, c) with straight lines over the samples that are not valid; absent channels stay NaN."""
    out = np.array(values)
    if not valid.all() and valid.any():
        index = np.arange(len(out))
        for c in range(out.shape[1]):
            out[:, c] = np.interp(index, index[valid], out[valid, c])
    return out
