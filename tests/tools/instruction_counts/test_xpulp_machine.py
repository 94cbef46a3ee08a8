"""The cluster's model: cycles of hand-counted code, instructions that only XPULP has, cores that wait for each
other."""

import pytest

pytest.importorskip("unicorn", reason="pip install unicorn")
pytest.importorskip("ziglang", reason="pip install ziglang")

from tools.instruction_counts.build import build
from tools.instruction_counts.xpulp import BARRIER, BARRIER_CYCLES, XpulpMachine

SOURCE = r"""
#define NAKED __attribute__((naked))
NAKED void loop(void) { __asm__("li a0, 0\n li a1, 4\n 1: addi a0, a0, 1\n bne a0, a1, 1b\n ret"); }
NAKED void stall(void) { __asm__("lw a1, 0(a0)\n addi a0, a1, 1\n ret"); }
NAKED void noStall(void) { __asm__("lw a1, 0(a0)\n li a2, 1\n add a0, a1, a2\n ret"); }
NAKED void high(void) { __asm__("mulh a0, a0, a1\n ret"); }
NAKED void dot(void) { __asm__("cv.sdotsp.b a0, a1, a2\n ret"); }
NAKED void largest(void) { __asm__("cv.max.b a0, a0, a1\n ret"); }
NAKED void pack(void) { __asm__("cv.packlo.b a4, a1, a0\n cv.packhi.b a4, a3, a2\n mv a0, a4\n ret"); }
NAKED void half(void) { __asm__("cv.addrn a0, a0, zero, 1\n ret"); }
NAKED void rounded(void) { __asm__("cv.addrnr a0, a1, a2\n ret"); }
NAKED void clamp(void) { __asm__("cv.max a0, a0, a1\n cv.min a0, a0, a2\n ret"); }
NAKED void walk(void) { __asm__("cv.lb a1, (a0), 3\n cv.lbu a2, (a0), 1\n add a0, a1, a2\n ret"); }
NAKED void index(void) { __asm__("cv.lw a0, a1(a0)\n ret"); }
NAKED void store(void) { __asm__("cv.sw a1, (a0), 4\n cv.sb a2, (a0), a3\n ret"); }
typedef void barrier_t(void);
int turn;
int meet(int core, barrier_t *barrier, int work) {
  for (volatile int i = 0; i < work; i++) {}
  if (core == 0) turn = 7;
  barrier();
  return turn + core;
}
"""


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    source = tmp_path_factory.mktemp("probe") / "probe.c"
    source.write_text(SOURCE)
    return XpulpMachine(build([source], "rv32im-xpulp").elf)


@pytest.fixture
def call(machine):
    return lambda name, *arguments: machine.team(name, lambda _: arguments)


def signed(value: int) -> int:
    return value - (1 << 32) if value >> 31 else value


def test_cycles_of_hand_counted_code(call, machine):
    word = machine.allocate(4)
    # 2 li, 4 addi, 3 branches taken and 1 not, 1 return; hardware spares the taken ones for 2 of set-up.
    assert (call("loop").cycles, call("loop").looped) == (2 + 4 + 3 * 3 + 1 + 2, 2 + 4 + 1 + 2 + 2)
    assert (call("stall", word).cycles, call("noStall", word).cycles) == (1 + 1 + 1 + 2, 3 + 2)
    assert call("high", 1 << 20, 1 << 20).cycles == 5 + 2


def test_what_only_xpulp_has(call, machine):
    assert signed(call("dot", 1000, 0x80_7F_FF_01, 0x7F_7F_02_03).values[0]) == 1000 - 128 * 127 + 127 * 127 - 2 + 3
    assert call("largest", 0x80_7F_FF_01, 0x7F_80_00_02).values[0] == 0x7F_7F_00_02
    assert call("pack", 0x11, 0x22, 0xFFFFFF33, 0x44).values[0] == 0x44_33_22_11
    assert [signed(call("half", value).values[0]) for value in (3, -3, -2, 0)] == [2, -1, -1, 0]
    rounded = [signed(call("rounded", value, -1 if value < 0 else 0, 2).values[0]) for value in (6, 5, -6, -7)]
    assert rounded == [2, 1, -2, -2]
    assert [signed(call("clamp", value, -5, 9).values[0]) for value in (-70, 3, 70)] == [-5, 3, 9]


def test_loads_and_stores_that_move_on(call, machine):
    place = machine.allocate(16)
    machine.write(place, bytes([0xFE, 1, 2, 0xFD, 4, 5, 6, 7]))
    assert signed(call("walk", place).values[0]) == -2 + 0xFD
    assert call("index", place, 4).values[0] == 0x07060504
    call("store", place, 0x0A0B0C0D, 0xEE, 4)
    assert machine.read(place, 5) == bytes([0x0D, 0x0C, 0x0B, 0x0A, 0xEE])


def test_cores_wait_for_each_other(machine):
    machine.write("turn", bytes(4))
    slow = machine.team("meet", lambda core: (core, BARRIER, 200 if core == 3 else 0), 4)
    assert slow.values == [7, 8, 9, 10]
    machine.write("turn", bytes(4))
    single = machine.team("meet", lambda core: (core, BARRIER, 200), 1)
    assert abs(slow.cycles - single.cycles) < 10 and single.cycles > 200 + BARRIER_CYCLES
