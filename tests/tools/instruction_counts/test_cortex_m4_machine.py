"""The emulated processor: calls, floats, faults, the stack and counting, on both cores."""

import math
import struct

import pytest

from airtouch.errors import AirTouchError

pytest.importorskip("unicorn", reason="pip install unicorn")
pytest.importorskip("ziglang", reason="pip install ziglang")

from tools.instruction_counts.build import build
from tools.instruction_counts.elf import Elf
from tools.instruction_counts.machine import EmulationError, Machine

SOURCE = r"""
#include <math.h>
#include <string.h>
int started = 5;
int zeros[100];
const int fixed = 3;
int sum(int a, int b, int c, int d, int e, int f, int g, int h, int i, int j) {
  return a + 2 * b + 3 * c + 4 * d + 5 * e + 6 * f + 7 * g + 8 * h + 9 * i + 10 * j;
}
float mix(float a, int b, float c) { return a * c + (float)b; }
float root(float x) { return sqrtf(x); }
float scaled(float x, int e) { return ldexpf(x, e); }
float mantissa(float x, int *e) { return frexpf(x, e); }
float lessOne(float x) { return expm1f(x); }
int bump(void) { zeros[3]++; return ++started + zeros[3]; }
int fill(int n) { volatile char b[n]; for (int i = n - 1; i >= 0; i--) b[i] = 0; return b[n - 1]; }
void forever(void) { for (;;) started++; }
void writeNowhere(void) { *(volatile int *)0x123 = 1; }
void writeConstant(void) { *(volatile int *)&fixed = 1; }
int deeper(int n) { volatile int a[64]; a[0] = n; return n < 0 ? 0 : deeper(n + 1) + a[0]; }
int loop(int n) { volatile int s = 0; for (int i = 0; i < n; i++) s += i; return s; }
"""


@pytest.fixture(scope="module", params=["cortex-m4", "rv32imc"])
def loaded_machine(request, tmp_path_factory):
    source = tmp_path_factory.mktemp("probe") / "probe.c"
    source.write_text(SOURCE)
    program = build([source], request.param, optimise="-O1")
    assert build([source], request.param, optimise="-O1") == program
    return Machine(program.elf)


@pytest.fixture
def machine(loaded_machine):
    loaded_machine.reset()
    return loaded_machine


def test_arguments_in_registers_and_on_the_stack(machine):
    assert machine.call("sum", *range(1, 11)).value == sum(i * i for i in range(1, 11))
    machine.call("mix", 1.5, -7, 2.0)
    assert machine.float_result() == -4.0


def test_memory_lives_until_reset(machine):
    assert [machine.call("bump").value for _ in range(2)] == [7, 9]
    assert struct.unpack("<i", machine.read("started", 4)) == (7,)
    machine.write("started", struct.pack("<i", 40))
    assert machine.call("bump").value == 44
    machine.reset()
    assert machine.call("bump").value == 7


def test_the_library_is_the_hosts(machine):
    """Square root and scaling are exact; the others are for start-up and near enough."""
    address = machine.allocate(4)
    for x in (2.0, 0.7, 3.0e38, 1e-38, 1e-42):
        x32 = struct.unpack("<f", struct.pack("<f", x))[0]
        machine.call("root", x)
        assert machine.float_result() == pytest.approx(x32**0.5, rel=2.0**-24)
        machine.call("mantissa", x, address)
        exponent, = struct.unpack("<i", machine.read(address, 4))
        assert 0.5 <= machine.float_result() < 1.0 and machine.float_result() * 2.0**exponent == x32
    for exponent in (-200, -140, -126, 3, 127):
        machine.call("scaled", 0.75, exponent)
        assert machine.float_result() == struct.unpack("<f", struct.pack("<f", 0.75 * 2.0**exponent))[0]
    for x in (-3.0, -0.1, 1e-4, 0.4, 2.0):
        machine.call("lessOne", x)
        assert machine.float_result() == pytest.approx(math.expm1(x), rel=2e-7)


@pytest.mark.parametrize("name, words", [
    ("writeNowhere", "write to nowhere .4 bytes at 0x00000123. at writeNowhere"),
    ("writeConstant", "write to constants"),
    ("forever", "not done after 100000 instructions, at forever"),
    ("deeper", "stack of 65536 bytes overrun"),
    ("missing", "no symbol missing"),
])
def test_faults_say_what_and_where(machine, name, words):
    with pytest.raises(EmulationError, match=words):
        machine.call(name, 0, limit=100_000)
    machine.reset()
    assert machine.call("bump").value == 7


def test_the_stack_used_is_that_of_the_deepest_call(machine):
    machine.call("bump")
    shallow = machine.stack_used()
    machine.call("fill", 1000)
    assert shallow < 64 and 1000 <= machine.stack_used() < 1064


def test_each_round_of_a_loop_counts_the_same_instructions(machine):
    ten_rounds, more_rounds = machine.call("loop", 10).instructions, machine.call("loop", 1010).instructions
    per_round = (more_rounds - ten_rounds) / 1000
    assert 3 <= per_round <= 8 and (2 * per_round).is_integer()
    assert machine.call("loop", 10).instructions == ten_rounds


def test_what_does_not_compile_says_why(tmp_path):
    source = tmp_path / "broken.c"
    source.write_text("int f(void) { return 1.0f * missing; }\n")
    with pytest.raises(AirTouchError, match="undeclared identifier 'missing'"):
        build([source], "cortex-m4")
    with pytest.raises(AirTouchError, match="no core"):
        build([source], "z80")


def test_a_file_that_is_no_elf_is_refused(tmp_path):
    (tmp_path / "x").write_bytes(b"no")
    with pytest.raises(ValueError, match="not a 32-bit"):
        Elf(tmp_path / "x")
