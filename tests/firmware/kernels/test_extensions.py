"""The STM32's kernels without anything beyond C11, and by other compilers: the same bits."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from airtouch.kernels import band_power, library

ROOT = Path(__file__).parents[3]
KERNELS, HOST, GAP8 = ROOT / "firmware/kernels", ROOT / "host/airtouch/kernels/batch", ROOT / "gap8/kernels"
PLAIN = "-DAIRTOUCH_PLAIN_C"
FLAGS = ["-std=c11", "-ffp-contract=off", "-fno-math-errno", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion"]
#: zig checks for undefined behaviour at -O0; a trap needs no library, which would take 16 s to build
COMPILERS = {"cc": [shutil.which(os.environ.get("CC", "cc")) or ""], "clang": [shutil.which("clang") or ""],
             "zig": [sys.executable, "-m", "ziglang", "cc", "-fsanitize-trap=undefined"]
             if importlib.util.find_spec("ziglang") else [""]}
WORDS = re.compile(r"\b__\w+")


@pytest.fixture(params=COMPILERS)
def compiler(request):
    if not COMPILERS[request.param][0]:
        pytest.skip(f"no {request.param} on this machine")
    return COMPILERS[request.param]


@pytest.mark.parametrize("flags", [["-O0"], ["-O2"], ["-O2", PLAIN], ["-Os", PLAIN]], ids=" ".join)
def test_band_power_has_the_bits_of_the_package(compiler, flags, tmp_path, monkeypatch):
    """tests/kernels holds the package's bits against the definition."""
    out = tmp_path / "band_power.so"
    process = subprocess.run([*compiler, *FLAGS, *flags, "-shared", "-fPIC", f"-I{KERNELS}", KERNELS / "band_power.c",
                              HOST / "band_power_batch.c", "-lm", "-o", out], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    rng = np.random.default_rng(1)
    signals = (rng.normal(size=(900, 3)) * [1.0, 1e4, 1e-3] + [9.81, 4e4, 0.0]).astype(np.float32)
    signals[[40, 300, 301], [0, 1, 1]] = np.nan, np.inf, 1e15
    settings = [{}, {"window": 64, "band_hz": (3.0, 30.0)}, {"window": 150, "hop": 7}]
    expected = [band_power(signals, **s) for s in settings]
    monkeypatch.setattr(library, "lib", library.ffi.dlopen(str(out)))
    for setting, reference in zip(settings, expected, strict=True):
        power = band_power(signals, **setting)
        assert np.isfinite(power).any() and power.tobytes() == reference.tobytes()


@pytest.mark.parametrize("source", sorted(KERNELS.glob("*.c")), ids=lambda path: path.name)
def test_plain_c_is_c11_and_nothing_else(source, tmp_path):
    command = COMPILERS["cc"]
    if not command[0]:
        pytest.skip("no C compiler on this machine")
    sources = [*KERNELS.glob("*.[ch]"), *GAP8.glob("*.h")]
    for header in re.findall(r"#include <(.*?)>", "".join(path.read_text() for path in sources)):
        (tmp_path / header).write_text("")  # so that none of the C library's own words are there
    text = subprocess.run([*command, "-std=c11", "-nostdinc", f"-I{tmp_path}", f"-I{KERNELS}", f"-I{GAP8}", PLAIN, "-E",
                           "-P", source], capture_output=True, text=True, check=True).stdout
    assert len(text) > 500 and WORDS.findall(text) == [] and "_Pragma" not in text and "#pragma" not in text
