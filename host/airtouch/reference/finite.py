"""What every kernel does with samples that are not numbers."""

import numpy as np

#: Samples are clamped to this magnitude, so that no square or product of powers overflows float32.
SAMPLE_LIMIT = float(np.float32(1e15))
FLOAT32_MAX = float(np.finfo(np.float32).max)  #: samples beyond it are infinite to the kernels


def hold_finite(x: np.ndarray, initial: float | np.ndarray = 0.0) -> tuple[np.ndarray, int]:
    """Samples with the gaps filled causally, and how many were filled.

    x: (n,) or (n, c), any unit, as float32 would hold it. A NaN or infinite sample becomes the last finite
    one of its column (`initial` before any); magnitudes are clamped to SAMPLE_LIMIT.
    Returns float64 of the same shape. C: sample_guard.h.
    """
    x = np.asarray(x, dtype=np.float64)
    finite = np.abs(x) <= FLOAT32_MAX
    if finite.all():
        return np.clip(x, -SAMPLE_LIMIT, SAMPLE_LIMIT), 0
    rows = np.arange(len(x)).reshape(-1, *([1] * (x.ndim - 1)))
    last = np.maximum.accumulate(np.where(finite, rows, -1), axis=0)
    filled = np.take_along_axis(x, np.maximum(last, 0), axis=0)
    filled = np.where(last >= 0, filled, initial)
    return np.clip(filled, -SAMPLE_LIMIT, SAMPLE_LIMIT), int(x.size - finite.sum())
