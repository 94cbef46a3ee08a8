"""Normalisation of the fused features in C: see `airtouch.reference.z_score_window`."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.arrays import float32, pointer
from airtouch.kernels.library import lib


def z_score_window(features: np.ndarray) -> np.ndarray:
    """Each column of each window (..., window, columns) to mean 0 and deviation 1, float32."""
    windows = float32(features)
    if windows.ndim < 2 or windows.shape[-2] == 0:
        raise AirTouchError(f"z-score: needs (..., window, columns), not {windows.shape}")
    length, columns = windows.shape[-2:]
    out = np.empty_like(windows)
    count = windows.size // (length * columns) if columns else 0
    if lib.zScoreWindowBatch(pointer(windows), count, length, columns, pointer(out)) < 0:
        raise AirTouchError(f"z-score: the kernel takes windows of at most 65535 samples, not {length}")
    return out


def streaming_z_score(features: np.ndarray, time_constant: float) -> np.ndarray:
    """Each sample (n, c) against its exponential mean and deviation, float32, as the reference."""
    if not (np.isfinite(time_constant) and time_constant > 0):
        raise AirTouchError(f"z-score: the time constant must be positive, not {time_constant}")
    samples = float32(features)
    if samples.ndim != 2:
        raise AirTouchError(f"z-score: needs (n, columns), not {samples.shape}")
    out = np.empty_like(samples)
    lib.streamingZScoreBatch(pointer(samples), *samples.shape, time_constant, pointer(out))
    return out
