"""How every kernel treats samples that are not finite: it holds the last finite one."""

import numpy as np

#: Samples are clamped to this magnitude, so that no square or product of powers overflows float32.
SAMPLE_LIMIT = float(np.float32(1e15))
#: Channels of known unit are clamped just above the sensor's full scale: the filters would remember a larger spike for
#: 30 s.
ACC_CLAMP = 240.0  #: m/s^2; full scale of the IMU is 24 g, 235 m/s^2
RATE_CLAMP = 40.0  #: rad/s; full scale of the IMU is 2000 degrees/s, 34.9 rad/s
PWM_MAX = 65535.0
AXIS_LIMIT = 1.0  #: of a unit vector's components
FLOAT32_MIN = float(np.finfo(np.float32).tiny)  #: FLT_MIN in C, the smallest normal float32
FLOAT32_MAX = float(np.finfo(np.float32).max)  #: samples beyond it are infinite to the kernels


def hold_finite(x: np.ndarray, initial: float | np.ndarray = 0.0,
                limit: float = SAMPLE_LIMIT) -> tuple[np.ndarray, int]:
    """Samples with gaps filled by the last finite value, and the number of filled samples.

    x: (n,) or (n, c), any unit, as float32 would hold it. A NaN or infinite sample becomes the last finite
    one of its column (`initial` before any); magnitudes are clamped to `limit`.
    Returns float64 of the same shape. C: sample_guard.h.
    """
    x = np.asarray(x, dtype=np.float64)
    finite = np.abs(x) <= FLOAT32_MAX
    if finite.all():
        return np.clip(x, -limit, limit), 0
    rows = np.arange(len(x)).reshape(-1, *([1] * (x.ndim - 1)))
    last = np.maximum.accumulate(np.where(finite, rows, -1), axis=0)
    filled = np.take_along_axis(x, np.maximum(last, 0), axis=0)
    filled = np.where(last >= 0, filled, initial)
    return np.clip(filled, -limit, limit), int(x.size - finite.sum())
