"""The int8 kernels without anything beyond C11, and by another compiler: the same bits."""

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gap8.kernels.conftest import FLAGS, KERNELS, MODEL

PLAIN = "-DAIRTOUCH_PLAIN_C"
SOURCES = [*sorted(KERNELS.glob("*_int8.c")), *sorted(MODEL.glob("*.c")), Path(__file__).with_name("golden.c")]
#: values in the tables of golden answers of the three exported networks
GOLDEN_OUTPUTS = sum(int(values) for header in MODEL.glob("*_golden.h")
                     for values in re.findall(r"GoldenOutputs\[(\d+)\];", header.read_text(encoding="utf-8")))
ZIG = [sys.executable, "-m", "ziglang", "cc"]
#: As much of the C library as the kernels use, without a compiler's own words in it.
HEADERS = {
    "stdint.h": "typedef signed char int8_t; typedef unsigned char uint8_t; typedef short int16_t;"
                "typedef unsigned short uint16_t; typedef int int32_t; typedef unsigned int uint32_t;"
                "typedef long long int64_t; typedef unsigned long long uint64_t;\n"
                "#define INT8_MIN (-128)\n#define INT8_MAX 127\n",
    "stdbool.h": "#define bool _Bool\n#define true 1\n#define false 0\n",
    "stddef.h": "typedef unsigned long size_t;\n#define NULL ((void *)0)\n",
    "string.h": '#include "stddef.h"\nvoid *memcpy(void *, const void *, size_t);'
                "void *memset(void *, int, size_t); int memcmp(const void *, const void *, size_t);",
}


def golden(command: list[str], out: Path, *flags: str) -> str:
    """What the golden vectors say of a build."""
    process = subprocess.run([*command, *FLAGS, *flags, *map(str, SOURCES), "-lm", "-o", str(out)], capture_output=True,
                             text=True)
    assert process.returncode == 0, process.stderr
    return subprocess.run([out], capture_output=True, text=True).stdout


@pytest.mark.parametrize("flags", [["-D__pulp__"], [PLAIN, "-D__pulp__", "-D__riscv_xcvsimd"]], ids=" ".join)
def test_plain_c_gives_the_golden_answers(compiler, flags, tmp_path):
    # __pulp__ alone does not make a compiler know XPULP.
    assert golden([compiler.command], tmp_path / "program", *flags) == f"{GOLDEN_OUTPUTS} same\n"


# The emulated targets are zig's, extensions and all.
@pytest.mark.parametrize("name, flags", [("clang", []), ("clang", [PLAIN]), ("zig", [PLAIN])])
def test_another_compiler_gives_the_golden_answers(name, flags, tmp_path):
    command = ZIG if name == "zig" else [shutil.which("clang") or ""]
    if not (importlib.util.find_spec("ziglang") if name == "zig" else command[0]):
        pytest.skip(f"no {name} on this machine")
    assert golden(command, tmp_path / "program", *flags) == f"{GOLDEN_OUTPUTS} same\n"


@pytest.mark.parametrize("source", sorted(KERNELS.glob("*.c")), ids=lambda path: path.name)
def test_plain_c_is_c11_and_nothing_else(compiler, source, tmp_path):
    for name, text in HEADERS.items():
        (tmp_path / name).write_text(text)
    command = [compiler.command, "-std=c11", "-nostdinc", f"-I{tmp_path}", f"-I{KERNELS}", PLAIN, "-D__pulp__",
               "-D__ARM_FEATURE_DSP", "-pedantic-errors", source]
    text = subprocess.run([*command, "-E", "-P"], capture_output=True, text=True, check=True).stdout
    assert re.findall(r"\b__\w+", text) == []
    compiled = subprocess.run([*command, "-c", "-o", tmp_path / "unit.o"], capture_output=True, text=True)
    assert compiled.returncode == 0, compiled.stderr
