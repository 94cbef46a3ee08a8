"""Runs a cross-compiled program in `unicorn`: functions are called by name, memory is read by name.

The machine is the processor with its memory and nothing else: no clock, no interrupt, no device.
Counts are instructions retired, not cycles.
"""

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import unicorn
from unicorn import Uc, UcError
from unicorn import arm_const as arm
from unicorn import riscv_const as riscv
from unicorn import unicorn_const as uc_const

from airtouch.errors import AirTouchError

from .counter import InstructionCounter
from .elf import ARM, Elf

PAGE = 4096                 #: bytes of a page of the emulator's memory
STACK_TOP = 0x3000_0000     #: a region of its own, so that running over its end is a fault
HEAP = 0x6000_0000          #: where `allocate` gives out memory
RETURN = 0x1F00_0000        #: what a called function returns to; a Cortex-M runs no code above 0x2000_0000
PAINT = 0xA5                #: byte that fills the stack, so that its deepest use can be read
LIMIT = 50_000_000          #: instructions a call may take unless told otherwise


class EmulationError(AirTouchError):
    """The program did what the processor does not allow, or did not end."""


class Call(NamedTuple):
    """What a call gave: r0 (a0) as an unsigned number, and the instructions it took."""

    value: int
    instructions: int


@dataclass(frozen=True)
class _Registers:
    """Unicorn's numbers of the registers that a call uses."""
    arguments: tuple[int, ...]
    floats: tuple[int, ...]  #: empty: floats travel as integers
    stack: int
    link: int
    counter: int


#: Arm, AAPCS32 with float registers
_ARM = _Registers(tuple(getattr(arm, f"UC_ARM_REG_R{i}") for i in range(4)),
                  tuple(getattr(arm, f"UC_ARM_REG_S{i}") for i in range(16)),
                  arm.UC_ARM_REG_SP, arm.UC_ARM_REG_LR, arm.UC_ARM_REG_PC)
#: RV32, ilp32
_RISCV = _Registers(tuple(getattr(riscv, f"UC_RISCV_REG_A{i}") for i in range(8)), (),
                    riscv.UC_RISCV_REG_SP, riscv.UC_RISCV_REG_RA, riscv.UC_RISCV_REG_PC)


class Machine:
    """A processor with a program in its memory.

    elf: a linked program (tools.instruction_counts.build). stack_bytes, heap_bytes: room for the stack and for
    `allocate`, whole pages. Code and constants cannot be written, and nothing but code can run.
    Raises EmulationError, one line, for what a processor would stop at.
    """

    def __init__(self, elf: Path, *, stack_bytes: int = 64 * 1024, heap_bytes: int = 4 * 1024 * 1024):
        self.elf = Elf(elf)
        self._is_arm = self.elf.machine == ARM
        self._registers = _ARM if self._is_arm else _RISCV
        self._stack_bytes, self._heap_bytes, self._heap_next = stack_bytes, heap_bytes, HEAP
        self._stack_used = 0
        self._uc = self._open()
        self._map()
        self._fault = ""
        self._uc.hook_add(uc_const.UC_HOOK_MEM_INVALID, self._note_fault)
        code = next(section for section in self.elf.sections if section.executable)
        self._counter = InstructionCounter(self._uc, code.address, code.data, thumb=self._is_arm)
        self.reset()

    def _open(self) -> Uc:
        """A new Unicorn of this core."""
        if not self._is_arm:
            return Uc(unicorn.UC_ARCH_RISCV, unicorn.UC_MODE_RISCV32)
        uc = Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        return uc

    def _map(self) -> None:
        """The program's pages, the stack, the heap, and a page to return to."""
        pages: dict[int, int] = {}
        for section in self.elf.sections:
            rights = uc_const.UC_PROT_READ | (uc_const.UC_PROT_WRITE if section.writable else 0)
            rights |= uc_const.UC_PROT_EXEC if section.executable else 0
            for page in range(section.address // PAGE, -(-(section.address + section.size) // PAGE)):
                pages[page] = pages.get(page, 0) | rights
        for page, rights in pages.items():
            self._uc.mem_map(page * PAGE, PAGE, rights)
        both = uc_const.UC_PROT_READ | uc_const.UC_PROT_WRITE
        self._uc.mem_map(STACK_TOP - self._stack_bytes, self._stack_bytes, both)
        self._uc.mem_map(HEAP, self._heap_bytes, both)
        self._uc.mem_map(RETURN, PAGE, uc_const.UC_PROT_ALL)

    def reset(self) -> None:
        """Memory as after power-on: variables at their start values, heap empty, stack painted."""
        for section in self.elf.sections:
            self._uc.mem_write(section.address, section.data or bytes(section.size))
        self._uc.mem_write(HEAP, bytes(self._heap_bytes))
        self._heap_next = HEAP
        self.paint_stack()
        if self._is_arm:
            self._uc.reg_write(arm.UC_ARM_REG_FPEXC, 1 << 30)  # the FPU is on
            self._uc.reg_write(arm.UC_ARM_REG_FPSCR, 0)

    def call(self, name: str, *arguments: int | float, limit: int = LIMIT) -> Call:
        """Calls a function: integers and addresses, or Python floats for `float` parameters.

        limit: instructions after which EmulationError says that it does not end.
        """
        begin = self.address(name)
        stack = self._pass(arguments)
        link = RETURN | 1 if self._is_arm else RETURN
        self._uc.reg_write(self._registers.stack, stack)
        self._uc.reg_write(self._registers.link, link)
        self._fault = ""
        self._counter.start(limit)
        try:
            self._uc.emu_start(begin | 1 if self._is_arm else begin, RETURN)
        except UcError as error:
            raise EmulationError(f"{name}: {self._fault or error} at {self._place()}") from None
        if self._counter.stopped:
            raise EmulationError(f"{name}: not done after {limit} instructions, at {self._place()}")
        return Call(self._uc.reg_read(self._registers.arguments[0]) & 0xFFFF_FFFF, self._counter.count)

    def float_result(self) -> float:
        """What the last call returned, for a function that returns float."""
        if self._registers.floats:
            bits = self._uc.reg_read(self._registers.floats[0])
        else:
            bits = self._uc.reg_read(self._registers.arguments[0])
        return struct.unpack("<f", struct.pack("<I", bits & 0xFFFF_FFFF))[0]

    def _pass(self, arguments: tuple[int | float, ...]) -> int:
        """Puts arguments where the calling convention wants them; returns the stack pointer."""
        integers, floats, rest = list(self._registers.arguments), list(self._registers.floats), []
        for value in arguments:
            in_float = isinstance(value, float) and self._registers.floats
            bits = struct.unpack("<I", struct.pack("<f", value))[0] if isinstance(value, float) else int(value)
            queue = floats if in_float else integers
            if queue:
                self._uc.reg_write(queue.pop(0), bits & 0xFFFF_FFFF)
            else:
                rest.append(bits & 0xFFFF_FFFF)
        top = (STACK_TOP - 4 * len(rest)) & ~15
        self._uc.mem_write(top, struct.pack(f"<{len(rest)}I", *rest))
        return top

    def address(self, name: str) -> int:
        """Where a function or variable lies."""
        if name not in self.elf.symbols:
            raise EmulationError(f"{self.elf.path.name}: no symbol {name}")
        return self.elf.symbols[name].address

    def allocate(self, size: int) -> int:
        """The address of `size` zero bytes, aligned to 8, that live until `reset`."""
        start = self._heap_next
        self._heap_next += -(-size // 8) * 8
        if self._heap_next > HEAP + self._heap_bytes:
            raise EmulationError(f"no room for {size} bytes beside {start - HEAP} of {self._heap_bytes}")
        return start

    def read(self, where: int | str, size: int) -> bytes:
        """Memory from an address or a symbol on."""
        return bytes(self._uc.mem_read(self._at(where), size))

    def write(self, where: int | str, data: bytes) -> None:
        """Puts bytes at an address or a symbol; constants can be written from out here."""
        self._uc.mem_write(self._at(where), bytes(data))

    def _at(self, where: int | str) -> int:
        """The address of a symbol, or the address itself."""
        return self.address(where) if isinstance(where, str) else where

    def paint_stack(self) -> None:
        """Forgets how deep the stack has been."""
        self._uc.mem_write(STACK_TOP - self._stack_bytes, bytes([PAINT]) * self._stack_bytes)

    def stack_used(self) -> int:
        """Bytes of stack that calls have written to since it was painted, to the nearest 4 below."""
        stack = self.read(STACK_TOP - self._stack_bytes, self._stack_bytes)
        return (len(stack) - (len(stack) - len(stack.lstrip(bytes([PAINT]))))) // 4 * 4

    def _note_fault(self, uc: Uc, access: int, address: int, size: int, value: int, data: object) -> bool:
        """Note a forbidden access in words, and stop."""
        kinds = {uc_const.UC_MEM_WRITE_UNMAPPED: "write to nowhere", uc_const.UC_MEM_READ_UNMAPPED: "read from nowhere",
                 uc_const.UC_MEM_WRITE_PROT: "write to constants", uc_const.UC_MEM_FETCH_UNMAPPED: "jump to nowhere",
                 uc_const.UC_MEM_FETCH_PROT: "jump into data"}
        kind = kinds.get(access, "forbidden access")
        below = STACK_TOP - self._stack_bytes
        if below - 64 * 1024 <= address < below:
            kind = f"stack of {self._stack_bytes} bytes overrun: {kind}"
        self._fault = f"{kind} ({size} bytes at {address:#010x})"
        return False

    def _place(self) -> str:
        """The function in which the program counter is."""
        return self.elf.where(self._uc.reg_read(self._registers.counter) & ~1)
