"""A table of contents, version 2, for parameters and log variables.

Layout, checksum and answers as in crazyflie-firmware 2026.08 (log.c, param_logic.c).
"""

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

GET_ITEM, GET_INFO = 2, 3
START, STOP = 0x81, 0x80  #: type bytes of the entries that begin and end a group
MOST_NAME = 24  #: characters of group and name together that fit into a packet


@dataclass(frozen=True)
class Item:
    """A variable: group, name and type byte with its flags."""

    group: str
    name: str
    kind: int

    @property
    def complete_name(self) -> str:
        """The name with its group: "group.name"."""
        return f"{self.group}.{self.name}"


class Toc:
    """A table of contents. shown: mask of the type byte for clients; extra: bytes after the info answer."""

    def __init__(self, items: Sequence[Item], shown: int, extra: bytes = b"") -> None:
        self.items, self._shown, self._extra = tuple(items), shown, extra
        self.ids = {item.complete_name: i for i, item in enumerate(self.items)}
        if len(self.ids) != len(self.items):
            raise ValueError("a name is there twice")
        for item in self.items:
            if len(item.group) + len(item.name) > MOST_NAME:
                raise ValueError(f"{item.complete_name} is too long")
        self.crc = _crc(self.items)

    def answer(self, data: bytes) -> bytes | None:
        """The answer to a packet on the TOC channel; None for a packet that the firmware ignores."""
        if not data:
            return None
        if data[0] == GET_INFO:
            return struct.pack("<BHI", GET_INFO, len(self.items), self.crc) + self._extra
        if data[0] != GET_ITEM or len(data) < 3:
            return None
        number = data[1] | data[2] << 8
        if number >= len(self.items):
            return bytes([GET_ITEM])
        item = self.items[number]
        names = item.group.encode() + b"\0" + item.name.encode() + b"\0"
        return struct.pack("<BHB", GET_ITEM, number, item.kind & self._shown) + names


def _crc(items: Sequence[Item]) -> int:
    """The CRC of the table, over the descriptions of all entries, including starts and ends of groups."""
    crc, group = 0, None
    entries: list[tuple[int, str]] = []
    for item in items:
        if item.group != group:
            if group is not None:
                entries.append((STOP, f"stop_{group}"))
            entries.append((START, item.group))
            group = item.group
        entries.append((item.kind, item.name))
    if group is not None:
        entries.append((STOP, f"stop_{group}"))
    for kind, name in entries:
        crc = zlib.crc32(struct.pack("<IB", crc, kind) + name.encode())
    return crc
