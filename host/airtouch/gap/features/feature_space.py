"""Features in units of what nominal flights of a vehicle scatter by, along a few hundred directions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.features import flight_features

SQUASHED = 5.0  #: standard deviations beyond which a feature grows with the logarithm only; chosen, as all numbers here
MIDDLE_TWO_THIRDS = (0.16, 0.84)  #: quantiles; in a normal density they are two standard deviations apart
LONG_SHIFT = 8.0  #: length of a whitened shift above which longer ones count no more in `directions`
SMALLEST_SINGULAR = 1e-6  #: of the largest, of a direction that is one
VARIANCE_DOUBT = 0.1  #: share of a feature's variance that no nominal flight shows: see `cholesky_factor`
SMALLEST = 1e-9  #: standard deviation of a feature that varies at all
MOST_MISSING = 0.5  #: share of nominal flights that may lack a feature; a larger number relies on fewer flights


@dataclass(frozen=True)
class Standard:
    """Median and standard deviation (features,) of each feature among nominal flights; 0: it says nothing."""

    middle: np.ndarray
    deviation: np.ndarray

    def __call__(self, features: np.ndarray) -> np.ndarray:
        """Standard deviations (n, features) from the median, squashed; 0 where there is nothing to tell by."""
        known = self.deviation > 0.0
        far = (np.where(np.isnan(features), self.middle, features) - self.middle) / np.where(known, self.deviation, 1.0)
        size = np.abs(far)
        squashed = np.sign(far) * SQUASHED * (1.0 + np.log(np.maximum(size, SQUASHED) / SQUASHED))
        return np.where(known, np.where(size > SQUASHED, squashed, far), 0.0)


def standard_of(nominal: np.ndarray) -> Standard:
    """The standard of nominal flights' features (n, features): the middle two thirds give the standard deviation.

    Both are of the flights that have a feature, NaN where missing; one that more than MOST_MISSING lack says nothing.
    """
    middle = np.nanmedian(nominal, axis=0)
    low, high = np.nanquantile(nominal, MIDDLE_TWO_THIRDS, axis=0)
    deviation = np.hypot(0.5 * (high - low), [f.least for f in flight_features.declared_features()])
    known = (deviation > SMALLEST) & (np.isnan(nominal).mean(axis=0) <= MOST_MISSING)
    return Standard(middle, np.where(known, deviation, 0.0))


def cholesky_factor(standard: np.ndarray, doubt: float = VARIANCE_DOUBT) -> np.ndarray:
    """Lower triangle L of the covariance L L' (features, features) of nominal flights (n, features), standardised.

    Each feature has a variance of its own beside what nominal flights show: no simulated vehicle is as exact as the
    cancellation of many features would need it, and few flights give fewer directions than features.
    """
    covariance = (1.0 - doubt) * np.cov(standard.T) + doubt * np.eye(standard.shape[1])
    return np.linalg.cholesky(covariance)


def directions(shifts: Sequence[np.ndarray], each: int, first: np.ndarray, of_first: int) -> np.ndarray:
    """Orthonormal directions (features, Q): `of_first` of `first` (n, features), `each` of every other set of shifts.

    All shifts are whitened; long ones count little more than short ones.
    """
    blocks = [_principal(first, of_first), *(_principal(s, each) for s in shifts)]
    return np.linalg.qr(np.concatenate(blocks, axis=1))[0]


def _principal(shifts: np.ndarray, many: int) -> np.ndarray:
    """The directions (features, many) in which shifts (n, features) lie, their lengths cut at LONG_SHIFT."""
    scaled = shifts / np.maximum(np.linalg.norm(shifts, axis=1, keepdims=True), LONG_SHIFT)
    _, size, axes = np.linalg.svd(scaled, full_matrices=False)
    return axes[:many][size[:many] > SMALLEST_SINGULAR * size[0]].T
