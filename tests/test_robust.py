"""The robust standard deviation against normal numbers of a known one."""

import numpy as np
import pytest
from scipy.stats import median_abs_deviation

from airtouch.robust import deviation


def test_the_deviation_of_normal_numbers_is_theirs_though_some_are_far_off():
    values = np.random.default_rng(2).normal(5.0, [1.0, 30.0], (20001, 2))
    values[:200] = 1e6
    assert deviation(values) == pytest.approx([1.0, 30.0], rel=0.03)
    assert deviation(values) == pytest.approx(median_abs_deviation(values, scale="normal"), rel=1e-4)
