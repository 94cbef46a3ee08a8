"""Samples that are not finite, against cases by hand."""

import numpy as np
import pytest

from airtouch.reference.finite import FLOAT32_MAX, SAMPLE_LIMIT, hold_finite

NAN, INF = np.nan, np.inf


@pytest.mark.parametrize(("x", "expected", "count"), [
    ([1.0, -2.0], [1.0, -2.0], 0),
    ([NAN, 3.0, NAN, INF, -4.0, -INF], [7.0, 3.0, 3.0, 3.0, -4.0, -4.0], 4),
    ([2.0 * FLOAT32_MAX, 5.0], [7.0, 5.0], 1),
    ([NAN, NAN], [7.0, 7.0], 2),
    ([], [], 0),
])
def test_a_gap_holds_the_last_finite_sample_and_is_counted(x, expected, count):
    values, gaps = hold_finite(np.array(x), initial=7.0)
    assert values.tolist() == expected and values.dtype == np.float64 and gaps == count


def test_columns_are_held_each_by_itself():
    values, gaps = hold_finite(np.array([[1.0, NAN], [NAN, 2.0], [3.0, NAN]]), initial=np.array([8.0, 9.0]))
    assert values.tolist() == [[1.0, 9.0], [1.0, 2.0], [3.0, 2.0]] and gaps == 3


@pytest.mark.parametrize("gap", [[], [NAN]])
def test_magnitudes_are_clamped_on_both_sides_with_a_gap_and_without(gap):
    values, _ = hold_finite(np.array([5.0, -5.0, FLOAT32_MAX, *gap]), limit=2.0)
    assert values[:3].tolist() == [2.0, -2.0, 2.0]
    large, _ = hold_finite(np.array([FLOAT32_MAX, -FLOAT32_MAX, *gap]))
    assert large[:2].tolist() == [SAMPLE_LIMIT, -SAMPLE_LIMIT]
