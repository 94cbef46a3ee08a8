"""The kernels pass the firmware's compiler flags, and sanitizers over arbitrary bytes."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from airtouch.parameters import c_header
from patience import HANG_S

ROOT = Path(__file__).parents[3]
KERNELS = ROOT / "firmware" / "kernels"
SOURCES = sorted(KERNELS.glob("*.c"))
GAP8 = ROOT / "gap8"
INCLUDES = ["-I", KERNELS, "-I", GAP8 / "kernels", "-I", GAP8 / "model"]
DRIVEN = [*SOURCES, *(GAP8 / "kernels" / f"{name}.c" for name in ("stream_int8", "dense_int8", "sparse_dense_int8")),
          GAP8 / "model" / "airtouch_stream.c"]
FIRMWARE_FLAGS = ["-std=gnu11", "-Os", "-Werror", "-Wdouble-promotion", "-Wall", "-Wextra"]
SANITIZERS = ["-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"]
FLOAT32 = np.array([np.nan, np.inf, -np.inf, 0, -0.0, 1e-45, 1e-38, 3.4e38, -3.4e38, 65535, 65536, -1, 1e15, 9.81, 0.5])


@pytest.fixture(scope="module")
def compiler():
    path = shutil.which(os.environ.get("CC", "cc"))
    if path is None:
        pytest.skip("no C compiler on this machine")
    return path


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.name)
def test_compiles_with_the_firmwares_flags(compiler, source, tmp_path):
    process = subprocess.run([compiler, *FIRMWARE_FLAGS, "-ffreestanding", *INCLUDES, "-c", source, "-o",
                              tmp_path / "kernel.o"], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr


@pytest.mark.parametrize("header", sorted(KERNELS.glob("*.h")), ids=lambda path: path.name)
def test_each_header_compiles_by_itself(compiler, header, tmp_path):
    unit = tmp_path / "unit.c"
    unit.write_text(f'#include "{header.name}"\n#include "{header.name}"\nint unused;\n')
    process = subprocess.run([compiler, *FIRMWARE_FLAGS, "-Wno-unused-function", *INCLUDES, "-fsyntax-only", unit],
                             capture_output=True, text=True)
    assert process.returncode == 0, process.stderr


@pytest.mark.parametrize("path", SOURCES + sorted(KERNELS.glob("*.h")), ids=lambda path: path.name)
def test_no_double_no_heap_no_globals(path):
    code = re.sub(r"//[^\n]*|/\*.*?\*/", "", path.read_text(), flags=re.DOTALL)
    assert not re.search(r"\b(double|malloc|calloc|realloc|free|printf)\b", code)
    assert not re.search(r"(?<![\w.])\d+\.\d*(e[-+]?\d+)?(?![\dfe])", code), "a literal without f is a double"
    assert not re.search(r"^static (?!const|inline|[\w ]+\**\s*\w+\()", code, flags=re.MULTILINE)


def test_the_generated_header_is_fresh():
    assert (KERNELS / "airtouch_parameters.h").read_text() == c_header(), (
        "stale: python -m airtouch.parameters > firmware/kernels/airtouch_parameters.h")


def byte_files(folder):
    """Files of random bytes, of random floats with special values among them, and short ones."""
    rng = np.random.default_rng(0)
    for i in range(60):
        size = int(rng.choice([0, 1, 3, 40, 333, 4000, 40_000]))
        if i % 3 == 0:
            data = rng.bytes(size)
        else:
            values = rng.normal(0, 10.0 ** rng.integers(-3, 6), size // 4)
            special = rng.random(values.size) < (0.2 if i % 3 == 1 else 0.001)
            values[special] = rng.choice(FLOAT32, special.sum())
            data = rng.bytes(24) + values.astype(np.float32).tobytes()
        (folder / f"{i}.bin").write_bytes(data)
    return sorted(folder.glob("*.bin"))


def test_sanitizers_find_nothing_in_any_bytes(compiler, tmp_path):
    probe = tmp_path / "probe.c"
    probe.write_text("int main(void) { return 0; }\n")
    if subprocess.run([compiler, *SANITIZERS, probe, "-o", tmp_path / "probe"], capture_output=True).returncode:
        pytest.skip(f"{compiler} has no address and undefined-behaviour sanitizers")
    driver = tmp_path / "driver"
    build = subprocess.run([compiler, "-std=gnu11", "-O1", "-g1", *FIRMWARE_FLAGS[2:], *SANITIZERS, *INCLUDES,
                            *DRIVEN, Path(__file__).with_name("driver.c"), "-lm", "-o", driver],
                           capture_output=True, text=True)
    assert build.returncode == 0, build.stderr
    files = byte_files(tmp_path)
    process = subprocess.run([driver, *files], capture_output=True, text=True, timeout=HANG_S)
    assert process.returncode == 0, process.stderr[-3000:]
    assert process.stdout == f"{len(files)} files\n"
