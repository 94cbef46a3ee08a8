"""Parameters: read, write, write by name, defaults, extended types and persistent storage (param_logic.c)."""

import errno
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from airtouch.sitl.services.packet import PARAM, Packet
from airtouch.sitl.services.toc import Item, Toc

TOC_CHANNEL, READ_CHANNEL, WRITE_CHANNEL, MISC_CHANNEL = 0, 1, 2, 3
(SET_BY_NAME, VALUE_UPDATED, EXTENDED_TYPE, STORE, GET_STATE, CLEAR, DEFAULT, EXTENDED_TYPE_V2,
 DEFAULT_V2) = range(9)
CODES = {"int8_t": 0, "int16_t": 1, "int32_t": 2, "float": 6, "uint8_t": 8, "uint16_t": 9, "uint32_t": 10}
FORMATS = {0: "<b", 1: "<h", 2: "<i", 6: "<f", 8: "<B", 9: "<H", 10: "<I"}
EXTENDED, CORE, READ_ONLY = 0x10, 0x20, 0x40  #: bits of the type in the table of contents (param.h)
PERSISTENT = 1  #: bit of the extended type
KIND = 0x0F  #: mask of the bits with the C type


@dataclass(frozen=True)
class Parameter:
    """A parameter as the firmware declares it."""

    name: str  #: "group.name"
    ctype: str
    default: float
    read_only: bool = False
    persistent: bool = False
    core: bool = False

    def item(self) -> Item:
        """Its entry in the table of contents."""
        group, name = self.name.split(".")
        flags = READ_ONLY * self.read_only | EXTENDED * self.persistent | CORE * self.core
        return Item(group, name, CODES[self.ctype] | flags)


class ParamService:
    """The parameter port. changed(name, value) is called after a write; it returns all values that changed.

    The answer to a write repeats the written value, as in the firmware. A read returns the value in use.
    """

    def __init__(self, parameters: Sequence[Parameter],
                 changed: Callable[[str, float], dict[str, float]]) -> None:
        self.toc = Toc([p.item() for p in parameters], 0xFF)
        self._parameters = tuple(parameters)
        self._changed = changed
        self.values = {p.name: p.default for p in parameters}
        self._stored: dict[str, float] = {}

    def take(self, packet: Packet) -> list[Packet]:
        """The answers to a packet on the parameter port."""
        data = packet.data
        if packet.channel == TOC_CHANNEL:
            answer = self.toc.answer(data)
            return [Packet(PARAM, TOC_CHANNEL, answer)] if answer else []
        if packet.channel == MISC_CHANNEL:
            return self._misc(data)
        if len(data) < 2:
            return []
        number = data[0] | data[1] << 8
        if number >= len(self._parameters):
            return [Packet(PARAM, packet.channel, data[:2] + bytes([errno.ENOENT]))]
        if packet.channel == READ_CHANNEL:
            return [Packet(PARAM, READ_CHANNEL, data[:2] + b"\0" + self._bytes(number))]
        parameter = self._parameters[number]
        if parameter.read_only or len(data) - 2 < self._length(number):
            return []  # no answer, as in the firmware
        self._write(number, data[2:])
        return [Packet(PARAM, WRITE_CHANNEL, data)]

    def _length(self, number: int) -> int:
        return struct.calcsize(FORMATS[self.toc.items[number].kind & KIND])

    def _bytes(self, number: int, value: float | None = None) -> bytes:
        if value is None:
            value = self.values[self._parameters[number].name]
        return struct.pack(FORMATS[self.toc.items[number].kind & KIND], value)

    def _write(self, number: int, data: bytes) -> None:
        name = self._parameters[number].name
        value, = struct.unpack_from(FORMATS[self.toc.items[number].kind & KIND], data)
        self.values[name] = value
        self.values.update(self._changed(name, value))

    def _misc(self, data: bytes) -> list[Packet]:
        if not data:
            return []
        if data[0] == SET_BY_NAME:
            return self._by_name(data)
        if len(data) < 3 or data[0] == VALUE_UPDATED or data[0] > DEFAULT_V2:
            return []
        number, head = data[1] | data[2] << 8, data[:3]
        missing = [Packet(PARAM, MISC_CHANNEL, head + bytes([errno.ENOENT]))]
        if number >= len(self._parameters):
            return missing
        parameter = self._parameters[number]
        default = self._bytes(number, parameter.default)
        if data[0] in (EXTENDED_TYPE, EXTENDED_TYPE_V2):
            if not parameter.persistent:
                return missing
            answer = bytes([PERSISTENT]) if data[0] == EXTENDED_TYPE else bytes([0, PERSISTENT])
        elif data[0] in (DEFAULT, DEFAULT_V2):
            if parameter.read_only:
                return missing
            answer = default if data[0] == DEFAULT else b"\0" + default
        elif data[0] == GET_STATE:
            stored = self._stored.get(parameter.name)
            answer = b"\0" + default if stored is None else b"\1" + default + self._bytes(number, stored)
        elif data[0] == STORE:
            if not parameter.persistent:
                return missing
            self._stored[parameter.name] = self.values[parameter.name]
            answer = b"\0"
        else:
            answer = b"\0" if self._stored.pop(parameter.name, None) is not None else bytes([errno.ENOENT])
        return [Packet(PARAM, MISC_CHANNEL, head + answer)]

    def _by_name(self, data: bytes) -> list[Packet]:
        parts = data[1:].split(b"\0", 2)
        if len(parts) < 3 or not parts[2]:
            return []
        complete = b".".join(parts[:2]).decode("latin-1")
        number = self.toc.ids.get(complete)
        if number is None:
            error = errno.ENOENT
        elif parts[2][0] != self.toc.items[number].kind & KIND or len(parts[2]) - 1 < self._length(number):
            error = errno.EINVAL
        elif self._parameters[number].read_only:
            error = errno.EACCES
        else:
            error = 0
            self._write(number, parts[2][1:])
        return [Packet(PARAM, MISC_CHANNEL, data[:1] + parts[0] + b"\0" + parts[1] + b"\0" + bytes([error]))]
