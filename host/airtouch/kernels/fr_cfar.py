"""FR-CFAR in C: see `airtouch.reference.fr_cfar`."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.arrays import float32, pointer
from airtouch.kernels.library import lib
from airtouch.parameters import DEFAULT
from airtouch.reference.fr_cfar import check_settings

_TOO_LARGE = "FR-CFAR: the kernel holds at most 32767 cells, guard cells included, and P_FA as float32"


def fr_cfar(
    power: np.ndarray,
    *,
    guard_cells: int = DEFAULT.guard_cells,
    leading_window: int = DEFAULT.leading_window,
    p_fa: float = DEFAULT.p_fa,
) -> tuple[np.ndarray, np.ndarray]:
    """Threshold (n,) float32 and alert (n,) bool for each cell, as the reference."""
    check_settings(guard_cells, leading_window, p_fa)
    cells = float32(power)
    if cells.ndim != 1:
        raise AirTouchError(f"FR-CFAR: power must be (n,), not {cells.shape}")
    threshold, alert = np.empty(len(cells), np.float32), np.empty(len(cells), np.uint8)
    ring = np.empty(guard_cells + leading_window, np.float32)
    if lib.frCfarBatch(pointer(cells), len(cells), leading_window, guard_cells, p_fa, pointer(ring),
                       pointer(threshold), pointer(alert)) < 0:
        raise AirTouchError(_TOO_LARGE)
    return threshold, alert.astype(bool)


def threshold_factor(leading_window: int, p_fa: float) -> float:
    """alpha = N (P_FA^(-1/N) - 1) as the kernel has it."""
    check_settings(0, leading_window, p_fa)
    ring = np.empty(leading_window, np.float32)
    factor = lib.frCfarFactor(leading_window, 0, p_fa, pointer(ring))
    if not np.isfinite(factor):
        raise AirTouchError(_TOO_LARGE)
    return factor
