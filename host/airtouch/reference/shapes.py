"""Signals that are given for each sample, or once for all of them."""

from typing import Any

import numpy as np

from airtouch.errors import AirTouchError


def repeated(values: Any, shape: tuple[int, ...], name: str) -> np.ndarray:
    """`values` of each sample, or one for all of them, as float64 of this shape. Raises AirTouchError where it cannot.

    name: of the signal, for the error.
    """
    values = np.asarray(values, dtype=np.float64)
    try:
        return np.broadcast_to(values, shape)
    except ValueError:
        raise AirTouchError(f"{name}: must be {shape}, or one for all samples, not {values.shape}") from None
