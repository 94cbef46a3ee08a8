"""uSD-card logs of crazyflie-firmware from May 2018 to February 2021, which have no 0xBC in front.

Layout (crazyflie-firmware's tools/usdlog/CF_functions.py of 2019), little-endian: uint8 number of
variables; each as `name(t),` with t a struct type letter; a CRC-32 without its final inversion, of all
before it. Then blocks: uint8 number of rows, the packed rows, the same kind of CRC-32 of the block.
`tick` counts milliseconds; neural-swarm's firmware counts microseconds.
"""

import re
import struct
import zlib

import numpy as np

from airtouch.errors import AirTouchError, printable
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.formats.usd import TYPES
from airtouch.logs.variables import ASSUMED, to_columns

TIME = "tick"  #: the variable with the time
#: ticks of a median step, beyond which they are microseconds. The deck logs at 1 to 1000 Hz: a step has 1 to 1000 ms,
#: or 1000 to 1,000,000 us. So 500 to 1000 are ms at 1 to 2 Hz by the rates alone; no flight is logged so slowly.
LONGEST_STEP_MS = 500
LONGEST_IN_DOUBT = 1100  #: ticks of a median step up to which it may have been ms; 1000 and the jitter of a slow log
_VARIABLE = re.compile(rb"([\w.]{1,60})\(([" + "".join(TYPES).encode() + rb"])\),")


def matches(data: bytes) -> bool:
    """True for a log that begins with as many variables as its first byte announces."""
    return bool(data) and _variables(data) is not None


def read(data: bytes, source: str) -> FlightLog:
    """The FlightLog of an old uSD log.

    Blocks with a wrong checksum are left out; a truncated block gives its whole rows; both with a warning.
    Raises AirTouchError for a log without a usable row.
    """
    header = _variables(data) if data else None
    if header is None:
        raise AirTouchError(f"{source}: no old uSD log, as it does not begin with its variables")
    names, letters, place = header
    warnings: list[str] = []
    if not _sound(data[:place], data[place:place + 4]):
        warnings.append("the checksum of the header is wrong: the log is damaged; check its values")
    row = np.dtype([(f"v{i}", TYPES[letter]) for i, letter in enumerate(letters)])
    rows = np.frombuffer(_rows(data, place + 4, row.itemsize, warnings), dtype=row)
    if not len(rows):
        raise AirTouchError(f"{source}: the uSD log holds no complete row; was logging started?")
    table = {name: rows[f"v{i}"].astype(np.float64) for i, name in enumerate(names)}
    if TIME not in table:
        raise AirTouchError(f"{source}: an old uSD log without the variable 'tick' has no time; log it too")
    meta = {"source": source, "format": "usd-0", **ASSUMED, "condition": "", "warnings": warnings}
    columns = to_columns(table, meta)
    if not columns:
        known = ", ".join(printable(name) for name in names[:6])
        raise AirTouchError(f"{source}: none of its variables is known ({known}); log acc, gyro, motor and range")
    return FlightLog({"t_s": table[TIME] * _seconds(table[TIME], warnings)} | columns, meta)


def _seconds(ticks: np.ndarray, warnings: list[str]) -> float:
    """Seconds per tick. Adds a warning where they may be milliseconds or microseconds."""
    step = float(np.median(np.diff(ticks))) if len(ticks) > 1 else 0.0
    if LONGEST_STEP_MS < step <= LONGEST_IN_DOUBT:
        warnings.append(f"{TIME} rises by {step:g}: taken as microseconds ({1e6 / step:.0f} Hz); if the deck logged at "
                        f"{1e3 / step:.1f} Hz they are milliseconds and t_s is 1000 times too small")
    return 1e-6 if step > LONGEST_STEP_MS else 1e-3


def _variables(data: bytes) -> tuple[list[str], list[str], int] | None:
    """The variables' names, their type letters and the offset behind them; None if the data begins differently."""
    names, letters, place = [], [], 1
    for _ in range(data[0]):
        match = _VARIABLE.match(data, place)
        if match is None:
            return None
        names.append(match[1].decode())
        letters.append(match[2].decode())
        place = match.end()
    return (names, letters, place) if names else None


def _rows(data: bytes, place: int, size: int, warnings: list[str]) -> bytes:
    """The packed rows of all blocks with a right checksum, and the whole rows of a truncated block."""
    parts, damaged = [], 0
    while place < len(data):
        count = data[place]
        end = place + 1 + count * size
        if end + 4 > len(data):
            whole = min(count, (len(data) - place - 1) // size)
            warnings.append(f"the log is cut off in its last block, {whole} of {count} rows of it are kept")
            parts.append(data[place + 1:place + 1 + whole * size])
            break
        if _sound(data[place:end], data[end:end + 4]):
            parts.append(data[place + 1:end])
        else:
            damaged += 1
        place = end + 4
    if damaged:
        warnings.append(f"{damaged} blocks with a wrong checksum are left out; check the card")
    return b"".join(parts)


def _sound(data: bytes, checksum: bytes) -> bool:
    return checksum == struct.pack("<I", zlib.crc32(data) ^ 0xFFFFFFFF)
