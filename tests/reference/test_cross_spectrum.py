"""The fused feature against exact arithmetic."""

from fractions import Fraction
from math import isqrt

import numpy as np
import pytest

from airtouch.errors import AirTouchError
from airtouch.reference import cascaded_cross_spectrum


def exact_root(powers):
    """sqrt of the exact product, to 100 bits."""
    product = Fraction(1)
    for p in powers:
        product *= Fraction(float(p))
    scale = 1 << 2400
    return Fraction(isqrt(product.numerator * scale * scale // product.denominator), scale)


@pytest.mark.parametrize("axes", [1, 2, 3, 6, 40])
def test_equals_exact_arithmetic_for_any_number_of_axes(axes):
    rng = np.random.default_rng(axes)
    powers = 10.0 ** rng.uniform(-30, 30, size=(50, axes))
    powers[:, axes // 2:] = 1 / powers[:, :axes - axes // 2]  # the root stays in range, the way there does not
    ours = cascaded_cross_spectrum(powers, groups=(axes,))[:, 0]
    for row, value in zip(powers, ours, strict=True):
        expected = exact_root(row)
        if expected < Fraction(float(np.finfo(np.float32).max)):
            assert abs(Fraction(float(value)) / expected - 1) < 1e-13


def test_products_stay_within_float32_and_what_is_no_power_is_none():
    top = float(np.finfo(np.float32).max)
    rows = np.array([[1e300, 1e300, 1e300], [1e-300, 1e-300, 1e-300], [0, np.inf, 1], [4, 9, -1], [np.nan, 0, 1]])
    np.testing.assert_array_equal(cascaded_cross_spectrum(rows, (3,))[:, 0], [top, 0.0, 0.0, 0.0, np.nan])


def test_groups_are_neighbouring_columns():
    power = np.array([[4.0, 9.0, 25.0, 2.0, 8.0, 7.0]])
    np.testing.assert_allclose(cascaded_cross_spectrum(power, (3, 2, 1)), [[30.0, 4.0, 7.0**0.5]])


@pytest.mark.parametrize("groups", [(3, 3), (), (0, 9), (3, 3, 4)])
def test_groups_that_do_not_fit_are_refused(groups):
    with pytest.raises(AirTouchError):
        cascaded_cross_spectrum(np.ones((4, 9)), groups)
