"""CCS-FF: the axes of each sensor fused into one feature (paper, section 4.3)."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.reference.finite import FLOAT32_MAX


def cascaded_cross_spectrum(power: np.ndarray, groups: Sequence[int] = (3, 3, 3)) -> np.ndarray:
    """|P_ccs| of each group of channels: the square root of the product of their powers.

    power: (n, c) band powers; groups: how many neighbouring columns each sensor
    has, c in all. Returns (n, len(groups)), in the product of the groups' units.
    Mantissas are multiplied and exponents added, so no intermediate overflows;
    results saturate at the largest float32. NaN where a power is NaN; negative
    powers count as zero. Raises AirTouchError when groups and columns disagree.
    Source: equation (7), |P_ccs| = sqrt(|G_x1x1| ... |G_xnxn|).
    """
    power = np.asarray(power, dtype=np.float64)
    groups = tuple(int(g) for g in groups)
    if power.ndim != 2 or not groups or min(groups) < 1 or sum(groups) != power.shape[1]:
        raise AirTouchError(f"cross-spectrum: groups {groups} do not add up to powers of shape {power.shape}")
    edges = np.cumsum((0,) + groups)
    return np.column_stack([_root_of_product(power[:, a:b]) for a, b in pairwise(edges)])


def _root_of_product(power: np.ndarray) -> np.ndarray:
    """The square root of the product of each row of (n, k), (n,)."""
    clipped = np.where(power > FLOAT32_MAX, FLOAT32_MAX, np.where(power < 0, 0.0, power))
    mantissa, exponent = np.frexp(clipped[:, 0])
    exponent = exponent.astype(np.int64)
    for column in clipped.T[1:]:
        factor, shift = np.frexp(column)
        mantissa, carry = np.frexp(mantissa * factor)
        exponent += shift + carry
    odd = exponent & 1
    root = np.sqrt(np.ldexp(mantissa, odd))
    half = np.clip((exponent - odd) // 2, -2000, 2000)
    with np.errstate(over="ignore", under="ignore"):
        return np.minimum(np.ldexp(root, half), FLOAT32_MAX)
