"""Mutations of uSD logs: of their events, types, times, values and checksum, then of their bytes."""

import struct
import zlib
from random import Random

from .mutations import any_bytes, cut, zip_again

#: type of a variable -> its bytes
SIZES = {"b": 1, "B": 1, "?": 1, "h": 2, "H": 2, "i": 4, "I": 4, "l": 4, "L": 4, "q": 8, "Q": 8, "e": 2, "f": 4, "d": 8}
#: names of variables
NAMES = (b"acc.x", b"gyro.xRaw", b"stateEstimate.qw", b"stateEstimateZ.quat", b"range.left", b"pm.vbat", b"rpm.m1", b"",
         b"x", b"\xff\xfe", b"a\nb", b"\x1b[31m", b"n" * 3000, b"acc.x(f)", b"(", b"t_s", b"id", b"time", b"v0")
#: bytes that a record may come to hold
PAYLOADS = tuple(struct.pack("<d", v) for v in (float("nan"), float("inf"), 1e308, -1e308, 5e-324, -0.0)) + tuple(
    struct.pack("<f", v) for v in (float("nan"), float("-inf"), 3e38, -3e38, 1e-45)) + (b"\xff" * 8, b"\0" * 8)
#: times that a record may come to have
TIMES = (0, 1, 2**16, 2**31 - 1, 2**31, 2**32 - 1, 2**53, 2**62, 2**63 - 1, 2**63, 2**64 - 1)


class Log:
    """A sound uSD log taken apart: version, events [id, name, [[variable, type]]], records [id, time, payload]."""

    def __init__(self, data: bytes) -> None:
        self.version, count = struct.unpack_from("<HH", data, 1)
        place, self.events, self.records = 5, [], []
        for _ in range(count):
            (number,) = struct.unpack_from("<H", data, place)
            name, place = _text(data, place + 2)
            (variables,) = struct.unpack_from("<H", data, place)
            place += 2
            declared = []
            for _ in range(variables):
                text, place = _text(data, place)
                declared.append([text[:-3], chr(text[-2])])
            self.events.append([number, name, declared])
        sizes = {number: sum(SIZES[k] for _, k in declared) for number, _, declared in self.events}
        while place < len(data) - 4:
            number, tick = struct.unpack_from("<HI" if self.version == 1 else "<HQ", data, place)
            place += 6 if self.version == 1 else 10
            self.records.append([number, tick, data[place:place + sizes[number]]])
            place += sizes[number]

    def header(self, counts: tuple[int, int] = (0, 0)) -> bytes:
        """The header's bytes; `counts` are added to the numbers of events and of variables."""
        out = b"\xbc" + struct.pack("<HH", self.version & 0xFFFF, (len(self.events) + counts[0]) & 0xFFFF)
        for number, name, declared in self.events:
            out += struct.pack("<H", number) + name + b"\0" + struct.pack("<H", (len(declared) + counts[1]) & 0xFFFF)
            out += b"".join(name + b"(" + kind.encode() + b")\0" for name, kind in declared)
        return out

    def body(self) -> bytes:
        """The records' bytes."""
        layout, mask = ("<HI", 2**32 - 1) if self.version == 1 else ("<HQ", 2**64 - 1)
        return b"".join(struct.pack(layout, number, tick & mask) + payload for number, tick, payload in self.records)


def _text(data: bytes, place: int) -> tuple[bytes, int]:
    """The zero-terminated text at a place, and the place after it."""
    end = data.index(b"\0", place)
    return data[place:end], end + 1


def _events(log: Log, r: Random) -> None:
    """Names, types, ids and number of the events and variables."""
    event = r.choice(log.events)
    kind = r.randrange(9)
    variable = r.choice(event[2])
    if kind == 0:
        variable[0] = r.choice((*NAMES, r.choice(event[2])[0]))
    elif kind == 1:
        variable[1] = r.choice((*SIZES, "Z", "s", "x", " ", "P", "n"))
    elif kind == 2:
        event[0] = r.choice((0, 7, 9, 65535))
    elif kind == 3:
        event[1] = r.choice((b"", b"fixedFrequency", b"n" * 3000, b"\xff", b"a\nb"))
    elif kind == 4:
        log.events.append(r.choice(log.events))
    elif kind == 5:
        log.events.remove(event) if len(log.events) > 1 else None
    elif kind == 6:
        event[2].insert(0, list(variable)) if r.random() < 0.5 else event[2].remove(variable)
        event[2] = event[2] or [[b"acc.x", "f"]]
    elif kind == 7:
        r.shuffle(event[2])
    else:
        event[2][:] = event[2] * r.choice((2, 30))


def _times(log: Log, r: Random) -> None:
    """Times of one record, of a stretch or of all: extreme, shifted, scaled, with a bit flipped."""
    start = r.randrange(len(log.records))
    stop = r.choice((start + 1, start + 1, start + 5, len(log.records)))
    kind, bit, value = r.randrange(5), 1 << r.randrange(64), r.choice(TIMES)
    factor = r.choice((0, 2, 1000, 10**6, 10**9))
    for i, record in enumerate(log.records[start:stop]):
        if kind == 0:
            record[1] = value
        elif kind == 1:
            record[1] ^= bit
        elif kind == 2:
            record[1] += value
        elif kind == 3:
            record[1] *= factor
        else:
            record[1] = value + i * factor


def _records(log: Log, r: Random) -> None:
    """Records doubled, deleted, swapped, shuffled, of another event, of another size, with extreme values."""
    a, b = r.randrange(len(log.records)), r.randrange(len(log.records))
    kind = r.randrange(8)
    record = log.records[a]
    if kind == 0:
        log.records[a:a] = [list(log.records[b])] * r.choice((1, 5, 60))
    elif kind == 1:
        del log.records[min(a, b):max(a, b)]
    elif kind == 2:
        log.records[a], log.records[b] = log.records[b], record
    elif kind == 3:
        r.shuffle(log.records)
    elif kind == 4:
        record[0] = r.choice((0, 7, 9, 65535))
    elif kind == 5:
        record[2] = record[2][:r.randrange(len(record[2]) + 1)] + r.randbytes(r.choice((0, 0, 3)))
    else:
        value = r.choice(PAYLOADS)
        place = r.randrange(len(record[2]) + 1) & ~1
        for other in log.records[a:r.choice((a + 1, a + 5, len(log.records)))]:
            other[2] = (other[2][:place] + value + other[2][place + len(value):])[:len(other[2])]


def usd(data: bytes, r: Random) -> bytes:
    """One to three mutations of a uSD log's parts, with a right or a wrong checksum; some of its bytes only."""
    if r.random() < 0.25:
        data = any_bytes(data[:-4], r)
        return data + struct.pack("<I", zlib.crc32(data)) if r.random() < 0.7 else data
    log = Log(data)
    for _ in range(r.choice((1, 1, 2, 3))):
        if log.records:
            r.choice((_events, _times, _times, _records))(log, r)
    if r.random() < 0.05:
        log.version = r.choice((0, 1, 2, 3, 65535))
    counts = (r.choice((-1, 1, 1000)), r.choice((-1, 0, 1, 60000))) if r.random() < 0.05 else (0, 0)
    data = log.header(counts) + log.body()
    kind = r.random()
    data = data + struct.pack("<I", zlib.crc32(data)) if kind < 0.7 else data + r.randbytes(r.choice((0, 1, 4, 9)))
    if kind > 0.9:
        data = cut(data, r)
    return zip_again(data, r) if r.random() < 0.02 else data
