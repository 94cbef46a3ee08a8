"""The compiled sum against the same sum by NumPy."""

import numpy as np
import pytest

from airtouch.gap.evidence.likelihood import tailed


@pytest.mark.parametrize("exponents", [(-3.0, 3.0), (-60.0, -40.0), (40.0, 60.0)])
def test_the_sum_is_numpys(exponents):
    rng = np.random.default_rng(5)
    power = 10.0 ** rng.uniform(*exponents, 3000)
    size = power * rng.exponential(3.0, 3000) ** 4
    falls = np.repeat([13.0, 7.0, 13.0], 1000)
    known = rng.random(3000) > 0.1
    expected = np.where(known, np.log(power) + falls * np.log1p(size / power / 12.0), 0.0).sum()
    assert tailed(size, power, np.full(3000, 12.0), falls, known) == pytest.approx(expected, rel=1e-14)


def test_no_value_gives_nothing():
    assert tailed(*np.zeros((4, 0)), np.zeros(0, bool)) == 0.0
