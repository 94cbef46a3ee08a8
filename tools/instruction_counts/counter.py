"""Counts the instructions that an emulator runs, by a hook in machine code instead of Python.

A hook that calls back into Python costs about a microsecond a block, more than the block. This one
is compiled by Numba, is called once a block of code, and adds up in a buffer that it is handed.
"""

import ctypes
from functools import cache
from typing import Any

import numpy as np
from numba import carray as numba_carray
from numba import cfunc, types
from unicorn import unicorn_const
from unicorn.unicorn_py3 import unicorn as binding

carray: Any = numba_carray  # whose type hints know pointers of ctypes alone

# The buffer, in 64-bit words: these numbers, then for each halfword of code the halfwords of an
# instruction that starts there, then what is known of a block that starts there: size << 32 | instructions.
_COUNT, _LIMIT, _STOPPED, _BASE, _HALFWORDS, _TABLE = range(6)


class InstructionCounter:
    """Attached to an emulator; `count` since `start`, and whether `limit` ended the run.

    code: the bytes that can run, from address `base` on; thumb: Thumb-2, else compressed RISC-V.
    """

    def __init__(self, uc: Any, base: int, code: bytes, thumb: bool):
        halfwords = np.frombuffer(code[:len(code) // 2 * 2], dtype="<u2")
        long = halfwords >= 0xE800 if thumb else halfwords & 3 == 3
        self._numbers = np.zeros(_TABLE + 2 * len(halfwords), dtype=np.uint64)
        self._numbers[[_BASE, _HALFWORDS]] = base, len(halfwords)
        self._numbers[_TABLE:_TABLE + len(halfwords)] = 1 + long
        handle = ctypes.c_size_t()
        status = binding.uclib.uc_hook_add(
            uc._uch, ctypes.byref(handle), unicorn_const.UC_HOOK_BLOCK, ctypes.c_void_p(_hook().address),
            ctypes.c_void_p(self._numbers.ctypes.data), ctypes.c_uint64(1), ctypes.c_uint64(0))
        if status:
            raise RuntimeError(f"unicorn refuses the instruction counter: error {status}")

    def start(self, limit: int) -> None:
        """From zero; the run ends after about `limit` instructions, at the start of a block."""
        self._numbers[[_COUNT, _LIMIT, _STOPPED]] = 0, limit, 0

    @property
    def count(self) -> int:
        """Instructions since `start`."""
        return int(self._numbers[_COUNT])

    @property
    def stopped(self) -> bool:
        """Whether the limit ended the run."""
        return bool(self._numbers[_STOPPED])


@cache
def _hook() -> Any:
    """The compiled callback that counts the instructions of each block."""
    stop = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)(("uc_emu_stop", binding.uclib))

    @cfunc(types.void(types.voidptr, types.uint64, types.uint32, types.voidptr))
    def count(uc: Any, address: int, size: int, buffer: Any) -> None:
        head = carray(buffer, _TABLE, np.uint64)
        halfwords = np.int64(head[_HALFWORDS])
        table = carray(buffer, _TABLE + 2 * halfwords, np.uint64)
        first = (np.int64(address) - np.int64(head[_BASE])) >> 1
        if first < 0 or first >= halfwords:
            return  # the address that calls return to
        known = table[_TABLE + halfwords + first]
        if known >> np.uint64(32) != np.uint64(size):
            at, end, instructions = first, min(first + (np.int64(size) >> 1), halfwords), 0
            while at < end:
                at += np.int64(table[_TABLE + at])
                instructions += 1
            known = (np.uint64(size) << np.uint64(32)) | np.uint64(instructions)
            table[_TABLE + halfwords + first] = known
        head[_COUNT] += known & np.uint64(0xFFFFFFFF)
        if head[_COUNT] > head[_LIMIT]:
            head[_STOPPED] = np.uint64(1)
            stop(uc)

    return count
