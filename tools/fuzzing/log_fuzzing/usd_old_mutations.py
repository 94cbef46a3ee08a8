"""Mutations of uSD logs without 0xBC: of their variables, times, rows, blocks and checksums, then of their bytes."""

import struct
from random import Random

from .mutations import any_bytes, cut, zip_again
from .sound import pack_old_log
from .usd_mutations import NAMES, PAYLOADS, SIZES, TIMES


class Log:
    """A sound old uSD log taken apart: variables [[name, type]] and packed rows."""

    def __init__(self, data: bytes) -> None:
        place = 1
        self.variables: list[list] = []  #: name, type
        self.rows: list[bytes] = []
        for _ in range(data[0]):
            end = data.index(b",", place)
            self.variables.append([data[place:end - 3], chr(data[end - 2])])
            place = end + 1
        size, place = sum(SIZES[kind] for _, kind in self.variables), place + 4
        while place < len(data):
            count = data[place]
            self.rows += [data[place + 1 + i * size:place + 1 + (i + 1) * size] for i in range(count)]
            place += 1 + count * size + 4


def _variables(log: Log, r: Random) -> None:
    """Names, types, order and number of the variables."""
    variable, kind = r.choice(log.variables), r.randrange(7)
    if kind < 2:
        variable[0] = r.choice((*NAMES, b"tick", r.choice(log.variables)[0]))
    elif kind == 2:
        variable[1] = r.choice((*SIZES, "Z", "s", "x", " ", ")"))
    elif kind == 3:
        log.variables.insert(r.randrange(len(log.variables)), list(variable))
    elif kind == 4 and len(log.variables) > 1:
        log.variables.remove(variable)
    elif kind == 5:
        r.shuffle(log.variables)
    else:
        log.variables *= r.choice((2, 9))


def _times(log: Log, r: Random) -> None:
    """Times of one row, of a stretch or of all: extreme, shifted, scaled, with a bit flipped, or as a clock of its own.

    The time is taken to stand where it stood in the sound log, in front.
    """
    start = r.randrange(len(log.rows))
    stop = r.choice((start + 1, start + 1, start + 5, len(log.rows)))
    kind, bit, value = r.randrange(5), 1 << r.randrange(32), r.choice(TIMES)
    factor = r.choice((0, 2, 1000, 10**6))
    for i, row in enumerate(log.rows[start:stop], start):
        if len(row) < 4:
            continue
        tick = int.from_bytes(row[:4], "little")
        tick = (value, tick ^ bit, tick + value, tick * factor, value + i * factor)[kind]
        log.rows[i] = struct.pack("<I", tick & 2**32 - 1) + row[4:]


def _rows(log: Log, r: Random) -> None:
    """Rows doubled, deleted, swapped, shuffled, of another size, with extreme values."""
    a, b = r.randrange(len(log.rows)), r.randrange(len(log.rows))
    kind, row = r.randrange(7), log.rows[a]
    if kind == 0:
        log.rows[a:a] = [log.rows[b]] * r.choice((1, 5, 300))
    elif kind == 1:
        del log.rows[min(a, b):max(a, b)]
    elif kind == 2:
        log.rows[a], log.rows[b] = log.rows[b], row
    elif kind == 3:
        r.shuffle(log.rows)
    elif kind == 4:
        log.rows[a] = row[:r.randrange(len(row) + 1)] + r.randbytes(r.choice((0, 0, 3)))
    else:
        value, place = r.choice(PAYLOADS), r.randrange(len(row) + 1)
        for i in range(a, r.choice((a + 1, min(a + 5, len(log.rows)), len(log.rows)))):
            other = log.rows[i]
            log.rows[i] = (other[:place] + value + other[place + len(value):])[:len(other)]


def usd_old(data: bytes, r: Random) -> bytes:
    """One to three mutations of an old uSD log's parts, blocks of any length, some checksums and counts wrong."""
    if r.random() < 0.25:
        return any_bytes(data, r)
    log = Log(data)
    for _ in range(r.choice((1, 1, 2, 3))):
        if log.rows and log.variables:
            r.choice((_variables, _times, _times, _rows))(log, r)
    wrong = r.choice((0.0, 0.0, 0.0, 0.2, 1.0))

    def other(count: int, checksum: bytes) -> tuple[int, bytes]:
        """A block's count and checksum, now and then wrong ones."""
        if r.random() >= wrong:
            return count, checksum
        return r.choice((count, 0, 255, count - 1)) & 255, r.choice((checksum, r.randbytes(4), b""))

    data = pack_old_log(log.variables, log.rows, r.choice((1, 7, 255)), other)
    data = cut(data, r) if r.random() < 0.1 else data
    return zip_again(data, r) if r.random() < 0.02 else data
