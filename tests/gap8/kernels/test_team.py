"""One to eight threads, one a core: the same bits, and no race that ThreadSanitizer could see."""

import subprocess
from pathlib import Path

import pytest

from gap8.kernels.conftest import EMULATION, KERNELS, MODEL, THREADS, sanitized
from patience import HANG_S

SOURCES = [*sorted(KERNELS.glob("*.c")), *sorted(MODEL.glob("airtouch_[mrg]*.c")), Path(__file__).with_name("team.c")]


@pytest.fixture(scope="module", params=["portable", "xpulp"])
def programs(request, compiler, tmp_path_factory) -> dict[str, Path]:
    """The program, plain and under the sanitizers that work here, by their name."""
    folder = tmp_path_factory.mktemp(request.param)
    emulation = [EMULATION] if request.param == "xpulp" else []
    paths = {"plain": compiler(SOURCES, folder / "plain", THREADS, *emulation)}
    for name in ("thread", "address,undefined"):
        if compiler.has(*sanitized(name), folder=folder):
            paths[name] = compiler(SOURCES, folder / name.split(",")[0], *sanitized(name), *emulation)
    return paths


@pytest.mark.parametrize("cores", range(1, 9))
def test_any_number_of_cores_gives_the_golden_answers(programs, cores):
    process = subprocess.run([programs["plain"], str(cores), "3"], capture_output=True, text=True, timeout=HANG_S)
    assert (process.returncode, process.stdout) == (0, "same\n"), process.stderr


@pytest.mark.parametrize("cores", [2, 3, 8])
@pytest.mark.parametrize("sanitizer", ["thread", "address,undefined"])
def test_sanitizers_find_no_race_and_no_fault_of_memory(programs, sanitizer, cores):
    if sanitizer not in programs:
        pytest.skip(f"the C compiler has no {sanitizer} sanitizer that runs here")
    process = subprocess.run([programs[sanitizer], str(cores), "1"], capture_output=True, text=True, timeout=HANG_S)
    assert (process.returncode, process.stdout) == (0, "same\n"), process.stderr[-3000:]
