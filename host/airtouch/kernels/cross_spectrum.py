"""CCS-FF in C: see `airtouch.reference.cascaded_cross_spectrum`."""

from collections.abc import Sequence

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.arrays import float32, pointer
from airtouch.kernels.library import lib


def cascaded_cross_spectrum(power: np.ndarray, groups: Sequence[int] = (3, 3, 3)) -> np.ndarray:
    """|P_ccs| of each group of channels, (n, len(groups)) float32, as the reference."""
    powers = float32(power)
    sizes = np.asarray(groups, dtype=np.int64).reshape(-1)
    if powers.ndim != 2 or not len(sizes) or sizes.min() < 1 or sizes.sum() != powers.shape[1]:
        raise AirTouchError(f"cross-spectrum: groups {tuple(groups)} do not add up to powers of shape {powers.shape}")
    out = np.empty((len(powers), len(sizes)), dtype=np.float32)
    axes = sizes.astype(np.uint16)
    lib.crossSpectrumBatch(pointer(powers), len(powers), powers.shape[1], pointer(axes), len(axes),
                           pointer(out))
    return out
