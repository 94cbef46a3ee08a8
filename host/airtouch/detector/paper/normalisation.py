"""How fused features become network inputs: by window, as in the authors' data, or on a fixed scale."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.errors import AirTouchError

WINDOW = "z-score of each window and column"
FIXED = "logarithm to base 2, fixed mean and deviation of each column"
SMALLEST = 2.0**-40  #: a feature below this counts as this
LIMIT = 4.0  #: deviations at which inputs are clamped


@dataclass(frozen=True)
class FixedScale:
    """x = clip((log2(feature) - mean) / deviation, -LIMIT, LIMIT), column by column.

    mean, deviation: float32 (columns,), of the training flights in the air. A sample's input does
    not depend on other samples, so a network over it can roll from sample to sample. Band powers span
    decades: their logarithm, not they, fits in eight bits.
    """

    mean: np.ndarray
    deviation: np.ndarray

    def apply(self, features: np.ndarray) -> np.ndarray:
        """float32 inputs (n, columns) of fused features; NaN where a feature is not finite."""
        features = np.asarray(features, dtype=np.float64)
        levels = np.log2(np.maximum(np.where(np.isfinite(features), features, np.nan), SMALLEST))
        return np.clip((levels - self.mean) / self.deviation, -LIMIT, LIMIT).astype(np.float32)


def fit(features: Sequence[np.ndarray]) -> FixedScale:
    """The scale of features (n, columns), rows that are not finite left out. Raises AirTouchError without any."""
    rows = np.concatenate([np.asarray(part, dtype=np.float64) for part in features])
    rows = rows[np.isfinite(rows).all(axis=1)]
    if not len(rows):
        raise AirTouchError("training: no flight holds a full window in the air; 3 s of flight at 100 Hz are needed")
    levels = np.log2(np.maximum(rows, SMALLEST))
    deviation = np.maximum(levels.std(axis=0), 1e-3)
    return FixedScale(levels.mean(axis=0).astype(np.float32), deviation.astype(np.float32))
