"""C programs of the tests, built with address and undefined-behaviour sanitizers."""

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from objects import compiled

ROOT = Path(__file__).parents[2]
INCLUDES = [f"-I{ROOT / folder}" for folder in ("firmware/kernels", "firmware/link", "gap8/kernels", "gap8/model",
                                                "gap8/app/src", "tests/support")]
#: both ends of the link and the networks behind it
SOURCES = [*sorted((ROOT / "firmware" / "link").glob("*.c")), ROOT / "firmware/kernels/feature_window.c",
           *sorted((ROOT / "gap8" / "kernels").glob("*.c")), *sorted((ROOT / "gap8" / "app" / "src").glob("gap8_*.c")),
           *(ROOT / "gap8" / "model" / f"airtouch_{name}.c" for name in ("model", "rolling", "stream"))]
SANITIZERS = ["-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"]


#: -g1: line numbers for what a sanitizer finds; with variables GCC takes twice as long
FLAGS = ["-std=gnu11", "-O1", "-g1", "-Wall", "-Wextra", "-Werror", *SANITIZERS, *INCLUDES]


def build(driver: Path, program: Path) -> Path:
    """The program of a driver and SOURCES; skips the test where there is no compiler or no sanitizer."""
    return link([(FLAGS, [*SOURCES, driver])], program)


def link(parts: Sequence[tuple[list[str], Sequence[Path]]], program: Path) -> Path:
    """The program of sources, each with the flags beside it; skips as `build`.

    Programs that take the same sources with the same flags share the objects.
    """
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        pytest.skip("no C compiler on this machine")
    linked: list[Path] = []
    for flags, sources in parts:
        objects, error = compiled(compiler, flags, sources)
        if "libclang_rt" in error:
            pytest.skip(f"{compiler} has no sanitizers")
        assert not error, error
        linked += objects
    process = subprocess.run([compiler, *SANITIZERS, *linked, "-pthread", "-lm", "-o", program], capture_output=True,
                             text=True)
    if "cannot find -lasan" in process.stderr or "libclang_rt" in process.stderr:
        pytest.skip(f"{compiler} has no sanitizers")
    assert process.returncode == 0, process.stderr
    return program
