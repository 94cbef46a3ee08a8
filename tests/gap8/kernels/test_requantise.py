"""The one rounding, against fractions, over both paths."""

from fractions import Fraction

import numpy as np
import pytest
from cffi import FFI

from exact_int8 import requantised
from gap8.kernels.conftest import EMULATION

PROBE = """
#include "requantise.h"
void probe(const int32_t *sums, const int32_t *multipliers, const int8_t *shifts, int32_t count, int8_t *out) {
  layerInt8_t layer = {.outputZeroPoint = -5, .outputMin = -128, .outputMax = 127};
  for (int32_t i = 0; i < count; i++) {
    layer.multiplier = multipliers + i;
    layer.shift = shifts + i;
    out[i] = requantise(requantiser(&layer, 0, outputRange(&layer)), sums[i]);
  }
}
"""


@pytest.fixture(scope="module", params=["portable", "xpulp"])
def requantise(request, compiler, tmp_path_factory):
    folder = tmp_path_factory.mktemp("requantise")
    (folder / "rounding.c").write_text(PROBE)
    flags = ["-shared", "-fPIC", "-fsanitize=undefined", "-fno-sanitize-recover=all", "-static-libubsan"]
    if not compiler.has("-fsanitize=undefined", "-static-libubsan", folder=folder):
        flags = flags[:2]
    library = compiler([folder / "rounding.c"], folder / "rounding.so", *flags,
                       *([EMULATION] if request.param == "xpulp" else []))
    ffi = FFI()
    ffi.cdef("void probe(const int32_t *, const int32_t *, const int8_t *, int32_t, int8_t *);")
    lib = ffi.dlopen(str(library))

    def run(sums: np.ndarray, multipliers: np.ndarray, shifts: np.ndarray) -> np.ndarray:
        arrays = [np.ascontiguousarray(a, t) for a, t in ((sums, "i4"), (multipliers, "i4"), (shifts, "i1"))]
        out = np.empty(len(sums), np.int8)
        kinds = ("int32_t *", "int32_t *", "int8_t *")
        lib.probe(*(ffi.cast(k, a.ctypes.data) for k, a in zip(kinds, arrays, strict=True)), len(out),
                  ffi.cast("int8_t *", out.ctypes.data))
        return out

    return run


def test_requantise_is_exact_on_ties_and_beside_them(requantise):
    rng = np.random.default_rng(0)
    cases = []
    for _ in range(4000):
        shift = int(rng.integers(-31, 4))
        multiplier = int(rng.choice([2**30, 2**31 - 1, int(rng.integers(2**30, 2**31))]))
        # An accumulator whose result lies on or beside a tie of the second rounding.
        tie = int(rng.integers(-140, 140)) + Fraction(1, 2)
        middle = round(tie * Fraction(2**31, multiplier) * Fraction(2) ** -shift)
        cases += [(middle + d, multiplier, shift) for d in (-1, 0, 1)]
    limit = 2**28
    cases = [c for c in cases if abs(c[0]) < limit and abs(c[0]) * 2.0 ** max(c[2], 0) < 2**29]
    cases += [(int(rng.integers(-limit + 1, limit)), 2**31 - 1, s) for s in range(-31, 0) for _ in range(20)]
    assert len(cases) > 4000
    outputs = requantise(*np.array(cases).T)
    expected = [requantised(*case, zero_point=-5) for case in cases]
    np.testing.assert_array_equal(outputs, expected)
    assert len(set(expected)) > 200
