"""The int8 kernels built apart from the package: as the chip runs them, and with sanitizers."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from objects import compiled

ROOT = Path(__file__).parents[3]
KERNELS, MODEL, FIRMWARE = ROOT / "gap8/kernels", ROOT / "gap8/model", ROOT / "firmware/kernels"
BATCH = ROOT / "host/airtouch/kernels/batch"
FLAGS = ["-std=gnu11", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion",
         *(f"-I{folder}" for folder in (KERNELS, MODEL, BATCH, FIRMWARE))]
THREADS = "-pthread"  #: of every program here, so that all share their objects
EMULATION = "-DAIRTOUCH_XPULP_EMULATION"


def sanitized(name: str) -> list[str]:
    """Flags of a program under a sanitizer. -g1: line numbers; with variables GCC takes twice as long."""
    return [THREADS, "-O1", "-g1", f"-fsanitize={name}", "-fno-sanitize-recover=all"]


class Compiler:
    """The machine's C compiler."""

    def __init__(self, command: str):
        self.command = command

    def __call__(self, sources: list[Path], out: Path, *flags: str) -> Path:
        objects, error = compiled(self.command, [*FLAGS, *flags], sources)
        assert not error, error
        process = subprocess.run([self.command, *flags, *objects, "-lm", "-o", str(out)], capture_output=True,
                                 text=True)
        assert process.returncode == 0, process.stderr
        return out

    def has(self, *flags: str, folder: Path) -> bool:
        """Whether a program can be linked and run with these flags."""
        source, program = folder / "probe.c", folder / "probe"
        source.write_text("int main(void) { return 0; }\n")
        compiles = subprocess.run([self.command, *flags, source, "-o", program], capture_output=True).returncode == 0
        return compiles and subprocess.run([program], capture_output=True).returncode == 0


@pytest.fixture(scope="session")
def compiler() -> Compiler:
    path = shutil.which(os.environ.get("CC", "cc"))
    if path is None:
        pytest.skip("no C compiler on this machine")
    return Compiler(path)


@pytest.fixture(scope="session")
def xpulp_library(compiler: Compiler, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The kernels' XPULP path, its builtins emulated, behind the same calls as the package's library."""
    sources = [*sorted(KERNELS.glob("*.c")), *(BATCH / f"{n}_batch.c" for n in ("network", "rolling", "stream")),
               BATCH / "network_float.c", FIRMWARE / "feature_window.c"]
    return compiler(sources, tmp_path_factory.mktemp("xpulp") / "kernels.so", "-shared", "-fPIC", EMULATION)


@pytest.fixture(params=["portable", "xpulp"])
def path(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Runs a test over both paths of the kernels."""
    if request.param == "xpulp":
        from airtouch.kernels import network, rolling, stream
        from airtouch.kernels.library import ffi

        library = ffi.dlopen(str(request.getfixturevalue("xpulp_library")))
        for module in (network, rolling, stream):
            monkeypatch.setattr(module, "lib", library)
    return request.param
