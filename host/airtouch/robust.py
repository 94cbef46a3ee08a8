"""Robust statistics: what every layer may use."""

import numpy as np

#: standard deviation of a normal variable over the median of its absolute deviations: 1 / Phi^-1(3/4), rounded
MAD_TO_SIGMA = 1.4826


def deviation(values: np.ndarray) -> np.ndarray:
    """Standard deviation of values (n, ...) along the first axis, by the median of their distances from the median."""
    return MAD_TO_SIGMA * np.median(np.abs(values - np.median(values, axis=0)), axis=0)
