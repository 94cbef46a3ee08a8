"""C text of arrays and numbers, read back."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airtouch.detector.shared.c_source import array, float_literal


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_a_literal_is_exactly_its_float32(value):
    text = float_literal(value)
    assert text.endswith("f") and np.float32(text[:-1]) == np.float32(value)


@pytest.mark.parametrize("size", [0, 1, 7, 40, 500])
def test_an_array_holds_its_values_in_lines_that_fit(size):
    values = np.random.default_rng(size).integers(-2**31, 2**31, size).astype(np.int32)
    text = array("int32_t", "some", values)
    head, body = text.split("{", 1)
    assert head == f"_Alignas(4) static AIRTOUCH_MODEL_CONST int32_t some[{max(size, 1)}] = "
    assert [int(v) for v in re.findall(r"-?\d+", body)] == (values.tolist() or [0])
    assert max(map(len, text.splitlines())) <= 108
