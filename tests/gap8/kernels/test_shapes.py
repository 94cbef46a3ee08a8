"""Shapes that no memory holds are refused before any size is computed from them."""

import subprocess
from pathlib import Path

import pytest

from gap8.kernels.conftest import KERNELS, THREADS, sanitized
from patience import HANG_S

#: shape -> what the check says of it
EXPECTED = {
    "dense, rows x columns wrap to 0": "refused", "dense, 2^20 x 4096": "refused", "dense, 46341 squared": "refused",
    "dense, most channels": "refused", "dense, most outputs": "refused",
    "convolution, rows x columns wrap to 0": "refused", "stream, dilation of 2^30": "convolution 1 refused",
    "stream, rows x channels wrap to 0": "convolution 0 refused",
    "stream, the head's rows x channels wrap to 0": "head refused",
    # 4 + stride * 3 * 4000 samples and stride - 1 more, at most 65,535
    "window, stride 4": "good", "window, stride 5": "good", "window, stride 6": "convolution 1 refused",
    "window, stride 2147483647": "convolution 0 refused",
}
SOURCES = [*sorted(KERNELS.glob("*.c")), Path(__file__).with_name("shapes.c")]


@pytest.mark.parametrize("sanitizer", ["", "address,undefined"])
def test_sizes_beyond_int32_are_refused(compiler, tmp_path, sanitizer):
    flags = sanitized(sanitizer) if sanitizer else [THREADS]
    if not compiler.has(*flags, folder=tmp_path):
        pytest.skip(f"the C compiler has no {sanitizer} sanitizer that runs here")
    process = subprocess.run([compiler(SOURCES, tmp_path / "shapes", *flags)], capture_output=True, text=True,
                             timeout=HANG_S)
    assert process.returncode == 0, process.stderr
    assert dict(line.split(": ") for line in process.stdout.splitlines()) == EXPECTED
