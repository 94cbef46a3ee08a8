"""`read` and `write`: one entry point for every format, told apart by content."""

import os
import tempfile
import zlib
from pathlib import Path

from airtouch.errors import AirTouchError
from airtouch.logs import authors, canonical, crazypad, imrclab, usd
from airtouch.logs.flight_log import COLUMNS, FlightLog
from airtouch.logs.table import names_of, split_header

LARGEST_BYTES = 1 << 30  #: unpacked; more than this is no flight log


def read(path: str | Path) -> FlightLog:
    """A flight log from any known file, `.gz` or not; the content decides, not the name.

    Raises AirTouchError with file, place and remedy when it cannot be read.
    """
    return parse(_bytes(path), str(path))


def parse(data: bytes, source: str) -> FlightLog:
    """A flight log from a file's bytes; `source` names it in messages."""
    notes: list[str] = []
    log = _by_content(_unzipped(data, source, notes), source)
    log.meta["warnings"] = notes + list(log.meta.get("warnings", []))
    return log


def load_text(path: str | Path) -> bytes:
    """A text file's bytes, unzipped, line ends LF."""
    return _text(_unzipped(_bytes(path), str(path), []))


def write(log: FlightLog, path: str | Path, force: bool = False) -> None:
    """Write as the name ends: `.csv`, `.csv.gz` (canonical) or `.parquet`.

    The file appears whole or not at all. Raises AirTouchError for another ending,
    an existing file without `force`, and a place that cannot be written.
    """
    name = Path(path).name
    if name.endswith((".csv", ".csv.gz")):
        data = canonical.to_bytes(log, compress=name.endswith(".gz"))
    elif name.endswith(".parquet"):
        from airtouch.logs import parquet

        data = parquet.to_bytes(log)
    else:
        raise AirTouchError(f"{path}: unknown kind of file; end the name in .csv, .csv.gz or .parquet")
    write_bytes(data, Path(path), force)


def write_bytes(data: bytes, path: Path, force: bool = False) -> None:
    """Bytes into a file through a temporary one beside it."""
    if path.exists() and not force:
        raise AirTouchError(f"{path}: exists already; use --force to replace it")
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except OSError as error:
        if temporary and os.path.exists(temporary):
            os.unlink(temporary)
        raise AirTouchError(f"{path}: cannot be written: {error.strerror}") from None


def _by_content(data: bytes, source: str) -> FlightLog:
    if not data.strip(b" \t\r\n"):
        raise AirTouchError(f"{source}: the file is empty; log the flight again or leave it out")
    if data[:4] == b"PAR1":
        from airtouch.logs import parquet

        return parquet.read(data, source)
    if data[0] == usd.MAGIC:
        return usd.read(data, source)
    text = _text(data)
    if b"\x00" in text:
        raise AirTouchError(f"{source}: binary data of no known kind; known are uSD logs, Parquet and CSV")
    return _by_header(text, source)


def _text(data: bytes) -> bytes:
    return data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def _bytes(path: str | Path) -> bytes:
    try:
        size = os.stat(path).st_size
        data = Path(path).read_bytes() if size <= LARGEST_BYTES else b""
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise AirTouchError(f"{path}: cannot be read: {reason}") from None
    if size > LARGEST_BYTES:
        raise AirTouchError(f"{path}: {size / 2**30:.1f} GiB is too large for a flight log; split it")
    return data


def _by_header(text: bytes, source: str) -> FlightLog:
    _, first, _, line_number = split_header(text)
    if not first:
        raise AirTouchError(f"{source}: only comments, no data; log the flight again or leave it out")
    names = names_of(first)
    if _numeric(names[0]):
        return authors.read(text, source)
    if any(name in COLUMNS for name in names):
        return canonical.read(text, source)
    if crazypad.matches(names):
        return crazypad.read(text, source)
    if imrclab.matches(names):
        return imrclab.read(text, source)
    if {"pwm", "vbat[V]", "rpm1"} <= set(names):
        raise AirTouchError(f"{source}: a thrust-stand run, not a flight; leave it out")
    shown = first[:60].decode("ascii", "replace")
    raise AirTouchError(f"{source}:{line_number}: unknown header {shown!r}; "
                        "name the columns as in the table of columns")


def _numeric(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _unzipped(data: bytes, source: str, notes: list[str]) -> bytes:
    """Data as it is, or its gzip members joined; a file that is cut off gives what can be read."""
    if data[:2] != b"\x1f\x8b":
        return data
    parts: list[bytes] = []
    total = 0
    while data[:2] == b"\x1f\x8b":
        stream = zlib.decompressobj(wbits=31)
        try:
            parts.append(stream.decompress(data, LARGEST_BYTES - total + 1))
        except zlib.error as error:
            raise AirTouchError(f"{source}: the gzip data is damaged ({error}); "
                                "copy the file again") from None
        total += len(parts[-1])
        if total > LARGEST_BYTES:
            raise AirTouchError(f"{source}: unpacks to more than 1 GiB; no flight log is that large")
        if not stream.eof:
            notes.append("the gzip file is cut off; what could be unpacked was read")
            break
        data = stream.unused_data
    return b"".join(parts)
