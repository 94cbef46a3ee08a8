"""C programs of the tests, built with address and undefined-behaviour sanitizers."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from objects import compiled

ROOT = Path(__file__).parents[2]
INCLUDES = [f"-I{ROOT / folder}" for folder in ("firmware/kernels", "firmware/link", "gap8/kernels", "gap8/model",
                                                "gap8/app/src")]
#: both ends of the link and the networks behind it
SOURCES = [*sorted((ROOT / "firmware" / "link").glob("*.c")), ROOT / "firmware/kernels/feature_window.c",
           *sorted((ROOT / "gap8" / "kernels").glob("*.c")), *sorted((ROOT / "gap8" / "app" / "src").glob("gap8_*.c")),
           *(ROOT / "gap8" / "model" / f"airtouch_{name}.c" for name in ("model", "rolling", "stream"))]
SANITIZERS = ["-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"]


def build(driver: Path, program: Path) -> Path:
    """The program of a driver and SOURCES; skips the test where there is no compiler or no sanitizer."""
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        pytest.skip("no C compiler on this machine")
    flags = ["-std=gnu11", "-O2", "-g", "-Wall", "-Wextra", *SANITIZERS, *INCLUDES]
    made, error = compiled(compiler, flags, [*SOURCES, driver])
    assert not error, error
    done = subprocess.run([compiler, *SANITIZERS, *made, "-lm", "-o", program], capture_output=True, text=True)
    if "cannot find -lasan" in done.stderr or "libclang_rt" in done.stderr:
        pytest.skip(f"{compiler} has no sanitizers")
    assert done.returncode == 0, done.stderr
    return program
