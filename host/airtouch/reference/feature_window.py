"""Normalisation of the fused features: per window, as in the authors' data, and streaming."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.reference.finite import FLOAT32_MAX, hold_finite

STD_FLOOR = 1e-17  #: a streaming standard deviation below this counts as zero: its square leaves float32


def z_score_window(features: np.ndarray) -> np.ndarray:
    """Each column of each window to mean 0 and population standard deviation 1.

    features: (..., window, columns), any unit; same shape, no unit. A constant
    column gives 0. Non-finite samples hold the last finite one of their column.
    """
    features = np.asarray(features, dtype=np.float64)
    if features.ndim < 2 or features.shape[-2] == 0:
        raise AirTouchError(f"z-score: needs (..., window, columns), not {features.shape}")
    finite = np.moveaxis(hold_finite(np.moveaxis(features, -2, 0))[0], 0, -2)
    deviation = finite - finite[..., :1, :]
    span = np.abs(deviation).max(axis=-2, keepdims=True)
    deviation = deviation / np.where(span > 0, span, 1.0)
    deviation -= deviation.mean(axis=-2, keepdims=True)
    std = np.sqrt(np.square(deviation).mean(axis=-2, keepdims=True))
    return np.where(span > 0, deviation / np.where(span > 0, std, 1.0), 0.0)


def streaming_z_score(features: np.ndarray, time_constant: float) -> np.ndarray:
    """Each sample against the exponentially weighted mean and deviation up to and with it.

    features: (n, c); time_constant: samples in which a weight falls by e. Weights
    are normalised by their sum, so that the first samples are not biased towards
    zero. Same shape, no unit; 0 where the deviation is below STD_FLOOR (so for
    the first sample). A column starts at its first finite sample, 0 before;
    later gaps hold the last finite sample.
    """
    if not (np.isfinite(time_constant) and time_constant > 0):
        raise AirTouchError(f"z-score: the time constant must be positive, not {time_constant}")
    features = np.asarray(features, dtype=np.float64)
    if features.ndim != 2:
        raise AirTouchError(f"z-score: needs (n, columns), not {features.shape}")
    out = np.zeros(features.shape)
    for column, values in enumerate(features.T):
        starts = np.flatnonzero(np.abs(values) <= FLOAT32_MAX)
        if len(starts):
            out[starts[0]:, column] = _standardise(hold_finite(values[starts[0]:])[0], time_constant)
    return out


def _standardise(values: np.ndarray, time_constant: float) -> np.ndarray:
    """`streaming_z_score` of one column (n,) of finite values."""
    out = np.zeros(len(values))
    mean, variance = values[0], 0.0
    for i, (sample, gain) in enumerate(zip(values, exponential_gain(len(values), time_constant), strict=True)):
        step = sample - mean
        mean += gain * step
        variance = (1 - gain) * (variance + gain * step * step)
        std = variance**0.5
        out[i] = (sample - mean) / std if std >= STD_FLOOR else 0.0
    return out


def exponential_gain(n: int, time_constant: float) -> np.ndarray:
    """The weight of the newest sample in an exponential mean that started at sample 0, (n,)."""
    decay = np.exp(-1.0 / time_constant)
    return (1 - decay) / -np.expm1(-np.arange(1, n + 1) / time_constant)


def deviation_from_mean(x: np.ndarray, time_constant: float) -> np.ndarray:
    """x minus its exponential mean before that sample, (n,); 0 at the first."""
    if not (np.isfinite(time_constant) and time_constant > 0):
        raise AirTouchError(f"exponential mean: the time constant must be positive, not {time_constant}")
    if len(x) == 0:
        return np.zeros(0)
    from scipy.signal import lfilter  # slow to import, and only needed here

    recursion = [1.0, -np.exp(-1.0 / time_constant)]
    level = x - x[0]
    mean = lfilter([1.0], recursion, level) / lfilter([1.0], recursion, np.ones(len(x)))
    return level - np.concatenate([[0.0], mean[:-1]])
