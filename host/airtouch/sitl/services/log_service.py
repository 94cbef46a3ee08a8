"""Log blocks: create, append, start, stop and delete, as in the firmware (log.c)."""

import errno
import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from airtouch.sitl.services.packet import LOG, Packet
from airtouch.sitl.services.toc import Item, Toc

TOC_CHANNEL, CONTROL_CHANNEL, DATA_CHANNEL = 0, 1, 2
DELETE, START, STOP, RESET, CREATE_V2, APPEND_V2, START_V2 = 2, 3, 4, 5, 6, 7, 8
MOST_BLOCKS, MOST_VARIABLES, MOST_BYTES = 16, 128, 26
MEMORY_VARIABLE = 0xFFFF
CODES = {"uint8_t": 1, "uint16_t": 2, "uint32_t": 3, "int8_t": 4, "int16_t": 5, "int32_t": 6, "float": 7,
         "FP16": 8}
FLOAT, FP16 = CODES["float"], CODES["FP16"]
SIGNED = (CODES["int8_t"], CODES["int16_t"], CODES["int32_t"])
FP16_LARGEST = 65504.0  #: largest finite value of a half-precision float
FORMATS = {1: "B", 2: "H", 3: "I", 4: "b", 5: "h", 6: "i", 7: "f", 8: "e"}
LENGTHS = {code: struct.calcsize("<" + letter) for code, letter in FORMATS.items()}
TICK_MS = 10  #: ms per row of the simulator


@dataclass
class Block:
    """A block: (number of the variable, type in the packet) of each value, period in ms (0: stopped), next due time."""

    variables: list[tuple[int, int]] = field(default_factory=list)
    period_ms: int = 0
    due_ms: int = 0

    @property
    def length(self) -> int:
        """Bytes of values in a packet."""
        return sum(LENGTHS[kind] for _, kind in self.variables)


class LogService:
    """The log port. read(number): the present value of a variable, as its type in the TOC stores it."""

    def __init__(self, items: Sequence[Item], read: Callable[[int], float]) -> None:
        self.toc = Toc(items, 0x0F, bytes([MOST_BLOCKS, MOST_VARIABLES]))
        self._stored = [item.kind & 0x0F for item in items]
        self._read = read
        self.blocks: dict[int, Block] = {}

    def reset(self) -> None:
        """Delete all blocks."""
        self.blocks.clear()

    def take(self, packet: Packet, now_ms: int) -> list[Packet]:
        """The answers to a packet on the log port."""
        if packet.channel == TOC_CHANNEL:
            answer = self.toc.answer(packet.data)
            return [Packet(LOG, TOC_CHANNEL, answer)] if answer else []
        if packet.channel != CONTROL_CHANNEL or not packet.data:
            return []
        data = packet.data + b"\0" * max(0, 4 - len(packet.data))
        code = self._control(data, len(packet.data), now_ms)
        return [Packet(LOG, CONTROL_CHANNEL, bytes([data[0], data[1], code]))]

    def _control(self, data: bytes, size: int, now_ms: int) -> int:
        command, number = data[0], data[1]
        if command == RESET:
            self.reset()
            return 0
        if command == CREATE_V2:
            if number in self.blocks:
                return errno.EEXIST
            if len(self.blocks) == MOST_BLOCKS:
                return errno.ENOMEM
            self.blocks[number] = Block()
            return self._append(number, data[2:size])
        if command not in (DELETE, START, STOP, APPEND_V2, START_V2):
            return errno.ENOEXEC
        if number not in self.blocks:
            return errno.ENOENT
        if command == DELETE:
            del self.blocks[number]
        elif command == APPEND_V2:
            return self._append(number, data[2:size])
        else:
            period = 0 if command == STOP else 10 * data[2] if command == START else data[2] | data[3] << 8
            self.blocks[number].period_ms = period
            self.blocks[number].due_ms = now_ms + period
            if period == 0 and command != STOP:
                self.blocks[number].due_ms = -1  # the firmware sends such a block once
        return 0

    def _append(self, number: int, settings: bytes) -> int:
        block, at = self.blocks[number], 0
        while at + 3 <= len(settings):
            kind, variable = settings[at] & 0x0F, settings[at + 1] | settings[at + 2] << 8
            if block.length + LENGTHS.get(kind, 0) > MOST_BYTES:
                return errno.E2BIG
            if sum(len(b.variables) for b in self.blocks.values()) >= MOST_VARIABLES:
                return errno.ENOMEM
            if variable >= len(self._stored) or kind not in LENGTHS:  # there is no raw memory to log either
                return errno.ENOENT
            block.variables.append((variable, kind))
            at += 3
        return 0

    def due(self, now_ms: int) -> list[Packet]:
        """The packets of the blocks that are due."""
        packets = []
        for number, block in self.blocks.items():
            if block.due_ms < 0:
                block.due_ms = 0
            elif block.period_ms == 0 or now_ms < block.due_ms:
                continue
            else:
                while block.due_ms <= now_ms:
                    block.due_ms += block.period_ms
            head = bytes([number, now_ms & 0xFF, now_ms >> 8 & 0xFF, now_ms >> 16 & 0xFF])
            packets.append(Packet(LOG, DATA_CHANNEL, head + self._values(block)))
        return packets

    def _values(self, block: Block) -> bytes:
        return b"".join(encode(self._read(variable), kind)
                        for variable, kind in block.variables)


def encode(value: float, sent: int) -> bytes:
    """The bytes of a value in type `sent`, as in the firmware: integers wrap, FP16 overflows to infinity."""
    if sent in (FLOAT, FP16):
        if sent == FP16 and math.isfinite(value) and abs(value) > FP16_LARGEST:
            value = math.copysign(math.inf, value)
        return struct.pack("<" + FORMATS[sent], value)
    whole = int(value) if math.isfinite(value) else 0
    return (whole & (1 << 8 * LENGTHS[sent]) - 1).to_bytes(LENGTHS[sent], "little")


def hold(value: float, kind: int) -> float:
    """The value as a variable of type `kind` stores it: integers are truncated and limited to their range."""
    if kind in (FLOAT, FP16):
        return value
    if not math.isfinite(value):
        return 0
    bits, signed = 8 * LENGTHS[kind], kind in SIGNED
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
    return min(max(int(value), low), high)
