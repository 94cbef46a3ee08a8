"""Firmware images. Each is checked before it is flashed, so that a wrong file never reaches the drone.

Sources of the checks: the firmware's linker scripts (tools/make/F405/linker), in `vector_table` order, and the
AI-deck's bootloader (aideck-gap8-bootloader, src/bl.c, check-app-image.py).
"""

import struct
import subprocess
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from airtouch.errors import AirTouchError

TARGETS = {"stm32": "stm32-fw", "gap8": "deck-bcAI:gap8-fw"}  #: our name -> cfloader's
STM32_FLASH = range(0x0800_4000, 0x0810_0000)  #: the bootloader lies before it
STM32_STACK = (range(0x2000_0004, 0x2002_0001), range(0x1000_0004, 0x1001_0001))  #: RAM, CCM; Bitcraze's is odd
STM32_LEAST = 16_384  #: bytes; a smaller file is no firmware
STM32_VECTORS = 16  #: vectors of the Cortex-M4 itself, the stack pointer first
GAP8_L2 = range(0x1C00_0000, 0x1C06_0000)  #: L2 memory below the bootloader
GAP8_FC_L1 = range(0x1B00_0000, 0x1B00_2000)
GAP8_MOST_SEGMENTS = 16
GAP8_MOST = 0x0080_0000 - 0x0004_0000  #: bytes of flash behind the bootloader


@dataclass(frozen=True)
class Image:
    """A firmware image that can be flashed. target: "stm32" or "gap8"; entry: address of its first instruction."""

    path: Path
    target: str
    size_bytes: int
    entry: int


def inspect(path: Path, target: str | None = None) -> Image:
    """The image at `path`, after all checks. target: "stm32" or "gap8"; None recognises it by content.

    Raises AirTouchError with the check that fails.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise AirTouchError(f"{path}: {error.strerror}; build an image with `make firmware` or `make gap8`") from None
    if target is None:
        target = _guess(path, data)
    if target not in TARGETS:
        raise AirTouchError(f"flash: target {target!r} is none of {', '.join(TARGETS)}")
    entry = _stm32_entry(path, data) if target == "stm32" else _gap8_entry(path, data)
    return Image(path, target, len(data), entry)


def command(image: Image, uri: str | None) -> list[str]:
    """cfloader's command line. Without a URI it waits for a drone that is switched on by hand (cold boot)."""
    warm = ["-w", uri] if uri else ["-c"]
    return [sys.executable, "-m", "cfloader", "flash", str(image.path), TARGETS[image.target], *warm]


def flash(image: Image, uri: str | None) -> None:
    """Flash the image with cfloader. Raises AirTouchError if cfloader is missing or fails."""
    if find_spec("cfloader") is None:
        raise AirTouchError("cfloader is not installed: pip install airtouch[flash]")
    if image.target == "gap8" and not uri:
        raise AirTouchError("the AI-deck is flashed while the firmware runs: give --uri radio://...")
    done = subprocess.run(command(image, uri))
    if done.returncode != 0:
        hint = ("; a GAP8 is flashed through firmware with the AI-deck's driver: the stock one, or "
                "CONFIG=app-config-gap8")
        raise AirTouchError(f"cfloader failed with exit code {done.returncode}; see what it printed above"
                            + (hint if image.target == "gap8" else ""))


def _guess(path: Path, data: bytes) -> str:
    """The target of an image, recognised by its first bytes, not by its name."""
    for target, entry in (("stm32", _stm32_entry), ("gap8", _gap8_entry)):
        try:
            entry(path, data)
            return target
        except AirTouchError:
            continue
    raise AirTouchError(f"{path}: neither a Crazyflie firmware (.bin) nor a GAP8 flash image (.img)"
                        "; say --target stm32 or gap8 to read why")


def _stm32_entry(path: Path, data: bytes) -> int:
    if data[:4] == b"\x7fELF" or data[:1] == b":":
        raise AirTouchError(f"{path}: an ELF or HEX file; flash the .bin beside it")
    if not STM32_LEAST <= len(data) <= len(STM32_FLASH):
        raise AirTouchError(f"{path}: {len(data)} bytes; a firmware has {STM32_LEAST} to {len(STM32_FLASH)}")
    stack, *vectors = struct.unpack(f"<{STM32_VECTORS}I", data[:4 * STM32_VECTORS])
    if not any(stack in memory for memory in STM32_STACK):
        raise AirTouchError(f"{path}: no Crazyflie firmware: the stack would start at 0x{stack:08x}, outside RAM")
    inside = range(STM32_FLASH.start, STM32_FLASH.start + len(data))
    for number, vector in enumerate(vectors, start=1):
        needed = number <= 3  # reset, NMI, hard fault; others may be empty
        if (vector or needed) and not (vector % 2 == 1 and vector - 1 in inside):
            raise AirTouchError(f"{path}: no image for 0x{STM32_FLASH.start:08x} (behind the bootloader): "
                                f"vector {number} points to 0x{vector:08x}")
    return vectors[0] - 1


def _gap8_entry(path: Path, data: bytes) -> int:
    if not 32 <= len(data) <= GAP8_MOST:
        raise AirTouchError(f"{path}: {len(data)} bytes; a GAP8 image has 32 to {GAP8_MOST}")
    size, count, entry, _ = struct.unpack("<4I", data[:16])
    if not 1 <= count <= GAP8_MOST_SEGMENTS or not 16 * (1 + count) <= size <= len(data):
        raise AirTouchError(f"{path}: no GAP8 flash image: its header names {count} segments and {size} bytes; "
                            "use target.board.devices.flash.img")
    for number in range(count):
        offset, base, length, _ = struct.unpack("<4I", data[16 * (1 + number):16 * (2 + number)])
        if offset + length > len(data):
            raise AirTouchError(f"{path}: truncated: segment {number} ends at byte {offset + length} of {len(data)}")
        if length and not any(base in memory and base + length <= memory.stop for memory in (GAP8_L2, GAP8_FC_L1)):
            raise AirTouchError(f"{path}: segment {number}, 0x{base:08x} and {length} bytes, lies outside the GAP8's "
                                "memory or over its bootloader")
    if entry not in GAP8_L2:
        raise AirTouchError(f"{path}: no GAP8 flash image: entry at 0x{entry:08x}, outside L2")
    return entry
