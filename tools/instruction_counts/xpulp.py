"""Runs code for a core of GAP8's cluster, one or several at once, and counts its cycles by a model.

`unicorn` knows rv32im; the instructions that XPULP adds are those of CORE-V (core "rv32im-xpulp"), and are
done here when unicorn refuses them. Cores take turns between two barriers, so that a run is the same each time.

Cycles are those of RI5CY's manual with all memory in L1: 1 an instruction, 1 more where a loaded value is used
by the next one, 1 more for a jump, 2 more for a branch that is taken, 4 more for the upper half of a
product, 34 more for a division. Not in it: waits of eight cores for one memory bank, misses of the instruction
cache, waking the cluster. A barrier takes BARRIER_CYCLES.

Upstream compilers make no hardware loops; GAP8's compiler does for a loop without a branch inside. `cycles` leaves
loops as they are; `looped` takes off what a hardware loop saves: the branch back and its penalty, for two
instructions of set-up each time that the loop is entered.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from unicorn import riscv_const as riscv
from unicorn import unicorn_const as uc_const

from .machine import RETURN, STACK_TOP, EmulationError, Machine

BARRIER = RETURN + 16    #: a function that does nothing; the barrier of a team
BARRIER_CYCLES = 20      #: two instructions and the event unit, rounded up
_CORE_STACK = 4096       #: bytes of stack of each core
#: registers x0 to x31
_X = [riscv.UC_RISCV_REG_X0 + i for i in range(32)]
#: major opcodes, bits 0 to 6 of an instruction
_LOADS, _BRANCH, _JUMPS = (0x03,), 0x63, (0x6F, 0x67)
#: opcodes of the groups of xpulp instructions
_ALU, _POST_LOAD, _SIMD, _ROUND = 0x2B, 0x0B, 0x7B, 0x5B


@dataclass(frozen=True)
class Cycles:
    """What a call took, by the model above."""

    cycles: int        #: loops closed by branches
    looped: int        #: innermost loops closed by hardware
    instructions: int  #: of all cores
    values: list[int]  #: a0 of each core


class XpulpMachine(Machine):
    """A `Machine` for programs built for "rv32im-xpulp"."""

    def __init__(self, elf: Path):
        super().__init__(elf)
        code = next(section for section in self.elf.sections if section.executable)
        self._base = code.address
        words = [int.from_bytes(code.data[i:i + 4], "little") for i in range(0, len(code.data) - 3, 4)]
        self._table = [_decode(word) for word in words]
        self._innermost = _innermost(words)
        self._words = words
        self._forget()
        self._uc.hook_add(uc_const.UC_HOOK_INTR, self._on_unknown_instruction)
        self._uc.hook_add(uc_const.UC_HOOK_CODE, self._step)

    def team(self, name: str, arguments: Callable[[int], Sequence[int]], cores: int = 1) -> Cycles:
        """Calls a function on several cores, each with `arguments(core)`; they meet where they call BARRIER."""
        running = {core: self._start(name, arguments(core), core) for core in range(cores)}
        total = looped = instructions = 0
        values = [0] * cores
        while running:
            spent = []
            for core in list(running):
                context, begin = running[core]
                self._uc.context_restore(context)
                self._forget()
                self._uc.emu_start(begin, BARRIER)
                if self._uc.reg_read(riscv.UC_RISCV_REG_PC) != BARRIER:
                    raise EmulationError(f"{name}: core {core} stopped at {self._place()}")
                spent.append((self._cycles, self._cycles - self._saved))
                instructions += self._instructions
                back = self._uc.reg_read(riscv.UC_RISCV_REG_RA)
                if back == BARRIER:
                    values[core] = self._uc.reg_read(riscv.UC_RISCV_REG_A0) & 0xFFFF_FFFF
                    del running[core]
                else:
                    running[core] = (self._uc.context_save(), back)
            total += max(cycles for cycles, _ in spent) + BARRIER_CYCLES * bool(running)
            looped += max(cycles for _, cycles in spent) + BARRIER_CYCLES * bool(running)
        return Cycles(total, looped, instructions, values)

    def _start(self, name: str, arguments: Sequence[int], core: int) -> tuple[object, int]:
        """The registers of a core that begins a call, and the call's address."""
        for register, value in zip(_X[10:18], arguments, strict=False):
            self._uc.reg_write(register, value & 0xFFFF_FFFF)
        self._uc.reg_write(riscv.UC_RISCV_REG_SP, STACK_TOP - core * _CORE_STACK - 16)
        self._uc.reg_write(riscv.UC_RISCV_REG_RA, BARRIER)
        return self._uc.context_save(), self.address(name)

    def _forget(self) -> None:
        """Count from zero."""
        self._cycles = self._saved = self._instructions = 0
        self._loaded = 0             # register that the last instruction loaded
        self._branch = -1            # where the last instruction was a branch, its index
        self._counter.start(1 << 40)

    def _step(self, uc: object, address: int, size: int, data: object) -> None:
        """Before each instruction."""
        at = (address - self._base) >> 2
        if not 0 <= at < len(self._table):
            return
        cost, uses, loads, is_branch = self._table[at]
        self._instructions += 1
        if self._branch >= 0:
            last, self._branch = self._branch, -1
            if at != last + 1:
                cost += 2
                if at in self._innermost.get(last, ()):
                    self._saved += 3  # the branch and its penalty
            elif last in self._innermost:
                self._saved -= 2
        if self._loaded and uses & (1 << self._loaded):
            cost += 1
        self._loaded = loads
        if is_branch:
            self._branch = at
        self._cycles += cost

    def _on_unknown_instruction(self, uc: Any, number: int, data: object) -> None:
        """An instruction that unicorn does not know: the counter already stands behind it."""
        at = (uc.reg_read(riscv.UC_RISCV_REG_PC) - 4 - self._base) >> 2
        if number != 2 or not 0 <= at < len(self._words) or not self._extension(self._words[at]):
            self._fault = f"trap {number}"
            uc.emu_stop()

    def _extension(self, word: int) -> bool:
        """Does one instruction of CORE-V's; False where it is not one known here."""
        read, write = self._uc.reg_read, self._uc.reg_write
        opcode, funct3, funct7 = word & 0x7F, word >> 12 & 7, word >> 25
        rd, rs1, rs2 = word >> 7 & 31, word >> 15 & 31, word >> 20 & 31
        a = read(_X[rs1]) & 0xFFFF_FFFF
        if opcode == _SIMD and funct3 == 1:
            result = _simd(funct7, a, read(_X[rs2]) & 0xFFFF_FFFF, read(_X[rd]) & 0xFFFF_FFFF)
            if result is not None and rd:
                write(_X[rd], result)
            return result is not None
        if opcode == _POST_LOAD and funct3 in _SIZES:
            write(_X[rs1], (a + _sign_extend(word >> 20, 12)) & 0xFFFF_FFFF)
            return self._load(a, rd, funct3)
        if opcode == _ALU and funct3 < 3:
            offset = _sign_extend((word >> 25) << 5 | rd, 12)
            write(_X[rs1], (a + offset) & 0xFFFF_FFFF)
            return self._store(a, rs2, 1 << funct3)
        if opcode == _ROUND and funct3 == 2 and funct7 >> 5 == 2 and rd:  # cv.addrn
            shift = funct7 & 31
            total = _sign_extend(_sign_extend(a, 32) + _sign_extend(read(_X[rs2]), 32) + (1 << shift >> 1), 32)
            write(_X[rd], (total >> shift) & 0xFFFF_FFFF)
            return True
        if opcode != _ALU or funct3 != 3:
            return False
        b = read(_X[rs2]) & 0xFFFF_FFFF
        if funct7 < 0x10:  # loads: bit 2 says whether the address moves on or the offset is added first
            width = (funct7 & 3) | (4 if funct7 & 8 else 0)
            if not funct7 & 4:
                write(_X[rs1], (a + b) & 0xFFFF_FFFF)
            return self._load(a + b if funct7 & 4 else a, rd, width)
        if funct7 < 0x20:  # stores: the offset's register is where rd is
            offset = read(_X[rd])
            if not funct7 & 4:
                write(_X[rs1], (a + offset) & 0xFFFF_FFFF)
            return self._store(a + offset if funct7 & 4 else a, rs2, 1 << (funct7 & 3))
        result = _alu(funct7, a, b, rs2, read(_X[rd]) & 0xFFFF_FFFF)
        if result is not None and rd:
            write(_X[rd], result & 0xFFFF_FFFF)
        return result is not None

    def _load(self, address: int, rd: int, width: int) -> bool:
        """Load into a register; width: funct3 of the load. True: done."""
        size, signed = _SIZES[width]
        value = int.from_bytes(self.read(address & 0xFFFF_FFFF, size), "little", signed=signed)
        self._uc.reg_write(_X[rd], value & 0xFFFF_FFFF)
        return True

    def _store(self, address: int, rs2: int, size: int) -> bool:
        """Store a register's low bytes. True: done."""
        value = self._uc.reg_read(_X[rs2]) & ((1 << (8 * size)) - 1)
        self.write(address & 0xFFFF_FFFF, value.to_bytes(size, "little"))
        return True


#: funct3 of a load -> bytes, and whether they are signed
_SIZES = {0: (1, True), 1: (2, True), 2: (4, False), 4: (1, False), 5: (2, False)}


def _sign_extend(value: int, bits: int) -> int:
    """The low bits as a signed number."""
    value &= (1 << bits) - 1
    return value - (1 << bits) if value >> (bits - 1) else value


def _bytes(word: int) -> list[int]:
    """The four signed bytes of a word, the lowest first."""
    return [_sign_extend(word >> (8 * i), 8) for i in range(4)]


def _word(values: Sequence[int]) -> int:
    """The word of four bytes, the lowest first."""
    return sum((value & 0xFF) << (8 * i) for i, value in enumerate(values))


def _simd(funct7: int, a: int, b: int, d: int) -> int | None:
    """The result of a SIMD instruction on words a and b, and d of the target; None for an unknown one."""
    if funct7 == 0x54:  # cv.sdotsp.b
        return (d + sum(x * y for x, y in zip(_bytes(a), _bytes(b), strict=True))) & 0xFFFF_FFFF
    if funct7 == 0x18:  # cv.max.b
        return _word([max(x, y) for x, y in zip(_bytes(a), _bytes(b), strict=True)])
    if funct7 == 0x7C:  # cv.packlo.b
        return d & 0xFFFF_0000 | (a & 0xFF) << 8 | b & 0xFF
    if funct7 == 0x7D:  # cv.packhi.b
        return d & 0xFFFF | (a & 0xFF) << 24 | (b & 0xFF) << 16
    return None


def _alu(funct7: int, a: int, b: int, rs2: int, d: int) -> int | None:
    """The result of an ALU or multiply-accumulate instruction, not masked; None for an unknown one.

    rs2: number of the second register, in some instructions an immediate.
    """
    left, right = _sign_extend(a, 32), _sign_extend(b, 32)
    simple = {0x28: lambda: abs(left), 0x29: lambda: left <= right, 0x2A: lambda: a <= b,
              0x2B: lambda: min(left, right), 0x2C: lambda: min(a, b), 0x2D: lambda: max(left, right),
              0x2E: lambda: max(a, b), 0x30: lambda: _sign_extend(a, 16), 0x31: lambda: a & 0xFFFF,
              0x32: lambda: _sign_extend(a, 8), 0x33: lambda: a & 0xFF,
              0x48: lambda: d + left * right, 0x49: lambda: d - left * right}
    if funct7 in simple:
        return int(simple[funct7]())
    if funct7 == 0x38:  # cv.clip: to -2^(rs2 - 1) .. 2^(rs2 - 1) - 1
        bound = 1 << max(rs2 - 1, 0) if rs2 else 1
        return max(-bound, min(bound - 1, left))
    if funct7 == 0x42:  # cv.addrnr
        shift = b & 31
        return _sign_extend(_sign_extend(d, 32) + left + (1 << shift >> 1), 32) >> shift
    return None


def _decode(word: int) -> tuple[int, int, int, bool]:
    """Cycles, the registers it reads as bits, the register it loads, whether it is a branch."""
    opcode, funct3, funct7 = word & 0x7F, word >> 12 & 7, word >> 25
    rd, rs1, rs2 = word >> 7 & 31, word >> 15 & 31, word >> 20 & 31
    uses = 1 << rs1 if opcode not in (0x37, 0x17, 0x6F) else 0
    if opcode in (0x33, 0x63, 0x23, _ALU, _SIMD, _ROUND):
        uses |= 1 << rs2
    register_form = opcode == _ALU and funct3 == 3
    if opcode == _SIMD or register_form and (0x10 <= funct7 < 0x20 or funct7 in (0x42, 0x48, 0x49)):
        uses |= 1 << rd
    loads = rd if opcode in _LOADS or opcode == _POST_LOAD or register_form and funct7 < 0x10 else 0
    cost = 1
    if opcode == 0x33 and funct7 == 1:
        cost = 1 if funct3 == 0 else 5 if funct3 < 4 else 35
    if opcode in _JUMPS:
        cost = 2
    return cost, uses & ~1, loads, opcode == _BRANCH


def _innermost(words: Sequence[int]) -> dict[int, tuple[int]]:
    """Branches back over code without another branch or jump: index of the branch -> where it goes."""
    targets = {}
    for at, word in enumerate(words):
        if word & 0x7F != _BRANCH:
            continue
        bits = (word >> 31) << 12 | (word >> 7 & 1) << 11 | (word >> 25 & 63) << 5 | (word >> 8 & 15) << 1
        offset = _sign_extend(bits, 13)
        target = at + offset // 4
        if offset < 0 and not any(w & 0x7F in (_BRANCH, *_JUMPS) for w in words[target:at]):
            targets[at] = (target,)
    return targets
