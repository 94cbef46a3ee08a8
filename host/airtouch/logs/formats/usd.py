"""Bitcraze uSD-card logs: binary, versions 1 and 2, with a checksum at the end.

Layout (crazyflie-firmware, docs and tools/usdlog), little-endian: byte 0xBC; uint16
version; uint16 number of event types; for each its uint16 id, its name ending in a
zero byte, uint16 number of variables, and for each variable `name(t)` ending in a
zero byte with t a struct type letter. Then records: uint16 event id, time (uint32
milliseconds in version 1, uint64 microseconds in version 2), the packed variables.
Then the CRC-32 of all before it.
"""

import struct
import zlib
from array import array
from dataclasses import dataclass

import numpy as np

from airtouch.errors import AirTouchError, printable
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.table import MOST_COLUMNS
from airtouch.logs.variables import ASSUMED, to_columns

MAGIC = 0xBC
MAIN_EVENT = "fixedFrequency"
#: struct's type letters as NumPy's types
TYPES = {"b": "i1", "B": "u1", "?": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "l": "<i4",
          "L": "<u4", "q": "<i8", "Q": "<u8", "e": "<f2", "f": "<f4", "d": "<f8"}


@dataclass(frozen=True)
class Event:
    """A type of record: its name, its variables, and the dtype of a whole record."""

    name: str
    variables: tuple[str, ...]
    dtype: np.dtype


def read(data: bytes, source: str) -> FlightLog:
    """The FlightLog of the `fixedFrequency` records in a uSD log.

    A truncated log, or one with a wrong checksum, gives the records that can be read, with a
    warning. Raises AirTouchError for a damaged header and for a log without a usable record.
    """
    warnings: list[str] = []
    version, events, start = _header(data, source)
    end = len(data) - 4
    if end < start or zlib.crc32(data[:end]) != struct.unpack_from("<I", data, end)[0]:
        warnings.append("the checksum is wrong or missing: the log is cut off or damaged; "
                        "check its last values")
        end = len(data)
    offsets, stopped = _offsets(data, start, end, events)
    if end - stopped > 4 or (end - stopped and end < len(data)):
        warnings.append(f"{end - stopped} bytes from offset {stopped} on could not be read")
    chosen = _main_event(events, offsets, source)
    event, places = events[chosen], offsets[chosen]
    size = event.dtype.itemsize
    records = np.frombuffer(b"".join(data[o:o + size] for o in places), dtype=event.dtype)
    table = {name: records[f"v{i}"].astype(np.float64) for i, name in enumerate(event.variables)}
    meta = {"source": source, "format": f"usd-{version}", **ASSUMED, "condition": "", "warnings": warnings}
    columns = to_columns(table, meta)
    if not columns:
        names = ", ".join(printable(name) for name in event.variables[:6])
        raise AirTouchError(f"{source}: none of its variables is known ({names}); "
                            "log acc, gyro, motor and range")
    return FlightLog({"t_s": records["time"] * (1e-3 if version == 1 else 1e-6)} | columns, meta)


def _header(data: bytes, source: str) -> tuple[int, dict[int, Event], int]:
    """The version, the event types by id, and the offset of the first record."""
    try:
        version, count = struct.unpack_from("<HH", data, 1)
        if version not in (1, 2):
            raise AirTouchError(f"{source}: uSD log of version {version}; "
                                "versions 1 and 2 can be read, copy it from the card again")
        events: dict[int, Event] = {}
        place = 5
        for _ in range(count):
            (number,) = struct.unpack_from("<H", data, place)
            name, place = _text(data, place + 2)
            (variables,) = struct.unpack_from("<H", data, place)
            place += 2
            if variables > MOST_COLUMNS:
                raise AirTouchError(f"{source}: damaged uSD header: {variables} variables in one event, where "
                                    f"{MOST_COLUMNS} are the most; copy it from the card again")
            declared = []
            for _ in range(variables):
                text, place = _text(data, place)
                declared.append(text)
            if number in events:
                raise AirTouchError(f"{source}: damaged uSD header: two events have the number {number}; "
                                    "copy it from the card again")
            events[number] = _event(name, declared, version, source)
    except (struct.error, IndexError):
        raise AirTouchError(f"{source}: the uSD log ends within its header; "
                            "copy it from the card again") from None
    return version, events, place


def _text(data: bytes, place: int) -> tuple[str, int]:
    end = data.find(b"\x00", place)
    if end < 0:
        raise IndexError
    return data[place:end].decode("utf-8", "replace"), end + 1


def _event(name: str, declared: list[str], version: int, source: str) -> Event:
    fields = [("id", "<u2"), ("time", "<u4" if version == 1 else "<u8")]
    for i, text in enumerate(declared):
        letter = text[-2:-1]
        if len(text) < 4 or text[-3] != "(" or text[-1] != ")" or letter not in TYPES:
            raise AirTouchError(f"{source}: damaged uSD header: variable '{printable(text, 30)}' has no known type; "
                                "copy it from the card again")
        fields.append((f"v{i}", TYPES[letter]))
    return Event(name, tuple(text[:-3] for text in declared), np.dtype(fields))


def _offsets(data: bytes, place: int, end: int, events: dict[int, Event]) -> tuple[dict[int, array], int]:
    """Offsets of the whole records of each event type, and the offset at which reading stopped."""
    offsets = {number: array("q") for number in events}
    sizes = {number: event.dtype.itemsize for number, event in events.items()}
    while place + 2 <= end:
        number = data[place] | data[place + 1] << 8
        size = sizes.get(number)
        if size is None or place + size > end:
            break
        offsets[number].append(place)
        place += size
    return offsets, place


def _main_event(events: dict[int, Event], offsets: dict[int, array], source: str) -> int:
    """The id of `fixedFrequency`; in a log without it that of the event type with the most records."""
    filled = [number for number in events if offsets[number]]
    if not filled:
        raise AirTouchError(f"{source}: the uSD log holds no complete record; was logging started?")
    named = [number for number in filled if events[number].name == MAIN_EVENT]
    return named[0] if named else max(filled, key=lambda number: len(offsets[number]))
