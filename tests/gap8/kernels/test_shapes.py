"""Shapes that no memory holds are refused before any size is computed from them."""

import subprocess
from pathlib import Path

import pytest

from gap8.kernels.conftest import KERNELS, THREADS, sanitized
from patience import HANG_S

SOURCES = [*sorted(KERNELS.glob("*.c")), Path(__file__).with_name("shapes.c")]


@pytest.mark.parametrize("sanitizer", ["", "address,undefined"])
def test_sizes_beyond_int32_are_refused(compiler, tmp_path, sanitizer):
    flags = sanitized(sanitizer) if sanitizer else [THREADS]
    if not compiler.has(*flags, folder=tmp_path):
        pytest.skip(f"the C compiler has no {sanitizer} sanitizer that runs here")
    process = subprocess.run([compiler(SOURCES, tmp_path / "shapes", *flags)], capture_output=True, text=True,
                             timeout=HANG_S)
    assert (process.returncode, process.stdout) == (0, "0 0 0 0 0 0 1 0 1\n-1 -1 1 0\n"), process.stderr
