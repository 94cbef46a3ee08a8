"""Prints the instructions of the nine-channel step beside nine 256-point real FFTs of CMSIS-DSP, both emulated.

    python -m tools.instruction_counts.compare_fft [--sdist cmsisdsp-1.10.3.tar.gz]    # 20 s

The FFT's sources are those in the source distribution of PyPI's `cmsisdsp` (Apache-2.0), which pip downloads
once to build/. They are compiled as Arm means it (-O2 and -O3, multiply-adds fused where the compiler likes),
by each compiler that is here; the least count stands. Only the FFTs are counted: neither window nor magnitude.
"""

import argparse
import os
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError, in_one_line

from .build import CACHE, build, compilers
from .flight_code import FlightCode, compile_flight_code, made_flight
from .machine import Machine

VERSION = "1.10.3"  #: of the package cmsisdsp
CHANNELS, POINTS = 9, 256  #: transforms of a step, and their length
#: files of CMSIS-DSP that a real FFT needs
_TRANSFORM = ("arm_rfft_fast_f32", "arm_rfft_fast_init_f32", "arm_cfft_f32", "arm_cfft_init_f32",
              "arm_cfft_radix8_f32", "arm_bitreversal2")
#: CMSIS-DSP's files of the transform
_SOURCES = (*(f"Source/TransformFunctions/{name}.c" for name in _TRANSFORM),
            "Source/CommonTables/arm_common_tables.c", "Source/CommonTables/arm_const_structs.c")
_PROBE = """
#include "arm_math.h"
arm_rfft_fast_instance_f32 fft;
float input[256], output[256];
int begin(void) { return arm_rfft_fast_init_f32(&fft, 256); }
void step(void) { arm_rfft_fast_f32(&fft, input, output, 0); }
"""


def unpack(sdist: Path | None, folder: Path = CACHE) -> Path:
    """The sources' folder, downloaded by pip where no archive is given."""
    target = folder / f"cmsisdsp-{VERSION}"
    if not target.is_dir():
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as work:
            archive = sdist or _download(Path(work))
            try:
                with tarfile.open(archive) as tar:
                    tar.extractall(work, filter="data")
                (Path(work) / f"cmsisdsp-{VERSION}").rename(target)
            except (OSError, tarfile.TarError) as error:
                raise AirTouchError(f"{archive}: not the source archive of cmsisdsp {VERSION}: {error}") from None
    return target


def _download(folder: Path) -> Path:
    """The source archive of cmsisdsp, downloaded into a folder. Raises AirTouchError without a connection."""
    run = subprocess.run(
        [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--no-binary", "cmsisdsp",
         "--no-build-isolation", "--dest", folder, f"cmsisdsp=={VERSION}"], capture_output=True, text=True)
    archives = list(folder.glob("cmsisdsp-*.tar.gz"))
    if run.returncode or not archives:
        raise AirTouchError(f"cmsisdsp {VERSION} cannot be downloaded: {run.stderr.strip()[-300:]}")
    return archives[0]


def fft_instructions(source: Path, compiler: str, optimise: str) -> int:
    """Instructions of one 256-point real FFT, its result compared with NumPy's."""
    CACHE.mkdir(parents=True, exist_ok=True)
    probe = CACHE / "fft_probe.c"
    new = probe.with_name(f"fft_probe.{os.getpid()}.c")
    new.write_text(_PROBE)
    new.replace(probe)
    program = build([*(source / s for s in _SOURCES), probe], "cortex-m4",
                    include=[source / "Include", source / "PrivateInclude"], optimise=optimise, compiler=compiler,
                    defines=["__GNUC_PYTHON__"], flags=("-w", "-ffp-contract=fast"))
    machine = Machine(program.elf)
    machine.call("begin")
    x = np.random.default_rng(0).normal(size=POINTS).astype(np.float32)
    machine.write("input", x.tobytes())
    count = machine.call("step").instructions
    y = np.frombuffer(machine.read("output", 4 * POINTS), dtype=np.complex64)
    if not np.allclose(y[1:], np.fft.rfft(x)[1:-1], atol=1e-3):
        raise AirTouchError("the FFT's result is not NumPy's")
    return count


def main() -> None:
    """Print instructions of CMSIS-DSP's transforms beside those of one step of the pipeline."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sdist", type=Path, help="the archive, instead of a download")
    sdist = parser.parse_args().sdist
    if sdist is not None and not sdist.is_file():
        parser.error(f"{sdist}: no such file")
    if not compilers("cortex-m4"):
        raise AirTouchError("no compiler for the Cortex-M4: pip install ziglang, or apt-get install gcc-arm-none-eabi")
    source = unpack(sdist)
    flight = made_flight()
    print(f"{'compiler':18}{'one FFT':>9}{'nine':>10}{'the step':>10}{'ratio':>8}")
    least, most = sys.maxsize, 0.0
    for compiler in compilers("cortex-m4"):
        for optimise in ("-O2", "-O3", "-Os"):
            fft = fft_instructions(source, compiler, optimise)
            code = FlightCode(compile_flight_code(optimise=optimise, compiler=compiler))
            steps = code.fly("edge_pipeline", flight)
            step = steps.instructions[steps.ready].mean()
            least, most = min(least, fft), max(most, step)
            name, nine = f"{compiler} {optimise}", CHANNELS * fft
            print(f"{name:18}{fft:9,}{nine:10,}{step:10,.0f}{nine / step:8.1f}")
    print(f"{'best / worst':18}{least:9,}{CHANNELS * least:10,}{most:10,.0f}{CHANNELS * least / most:8.1f}")


if __name__ == "__main__":
    with in_one_line("compare_fft"):
        main()
