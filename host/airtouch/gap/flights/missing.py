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
