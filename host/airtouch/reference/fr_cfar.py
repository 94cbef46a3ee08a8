"""FR-CFAR: an adaptive threshold without a lagging window (paper, section 5.1)."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from airtouch.errors import AirTouchError
from airtouch.parameters import DEFAULT
from airtouch.reference.finite import FLOAT32_MAX, FLOAT32_MIN, hold_finite

POWER_LIMIT = float(np.float32(1e30))  #: cells are clamped to this, the square of SAMPLE_LIMIT


def threshold_factor(leading_window: int, p_fa: float) -> float:
    """alpha = N (P_FA^(-1/N) - 1), equation (8): exact for exponentially distributed noise."""
    return float(leading_window * np.expm1(-np.log(p_fa) / leading_window))


def fr_cfar(
    power: np.ndarray,
    *,
    guard_cells: int = DEFAULT.guard_cells,
    leading_window: int = DEFAULT.leading_window,
    p_fa: float = DEFAULT.p_fa,
) -> tuple[np.ndarray, np.ndarray]:
    """Threshold and alert for each cell, from the cells before it alone.

    power: (n,), any unit, not negative. T = alpha times the mean of the
    `leading_window` cells that lie before the `guard_cells` before the cell under
    test; alert where the cell is greater than T. Returns threshold (n,), NaN while
    the leading window is not full, and alert (n,) bool, False there. Non-finite cells hold the
    last finite one, negative ones count as 0. Raises AirTouchError for settings out of range.
    """
    check_settings(guard_cells, leading_window, p_fa)
    cells = np.asarray(power, dtype=np.float64)
    if cells.ndim != 1:
        raise AirTouchError(f"FR-CFAR: power must be (n,), not {cells.shape}")
    cells = hold_power(cells)
    threshold = np.full(len(cells), np.nan)
    lag = guard_cells + leading_window
    if len(cells) > lag:
        leading = sliding_window_view(cells, leading_window)[:len(cells) - lag]
        threshold[lag:] = np.minimum(threshold_factor(leading_window, p_fa) * leading.mean(axis=1), FLOAT32_MAX)
    with np.errstate(invalid="ignore"):
        return threshold, cells > threshold


def hold_power(power: np.ndarray) -> np.ndarray:
    """Cells (n,) with gaps filled by the last finite cell (0 before the first), clamped to 0..POWER_LIMIT."""
    return np.clip(hold_finite(power, limit=POWER_LIMIT)[0], 0.0, POWER_LIMIT)


def check_settings(guard_cells: int, leading_window: int, p_fa: float) -> None:
    """Raise AirTouchError for a leading window, guard cells or P_FA out of range."""
    if int(leading_window) != leading_window or leading_window < 1:
        raise AirTouchError(f"FR-CFAR: the leading window must be at least 1 cell, not {leading_window}")
    if int(guard_cells) != guard_cells or guard_cells < 0:
        raise AirTouchError(f"FR-CFAR: guard cells must be 0 or more, not {guard_cells}")
    if not FLOAT32_MIN <= p_fa < 1:
        raise AirTouchError("FR-CFAR: the probability of false alarm must be a normal float32 below 1, at least "
                            f"{FLOAT32_MIN:.2g}, not {p_fa}")
