"""`read` and `write` flight logs. The format of a file is recognised by its content."""

import os
import secrets
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError, printable
from airtouch.logs.checks.readings import without_impossible_values
from airtouch.logs.flight_log import COLUMNS, LARGEST_BYTES, FlightLog
from airtouch.logs.formats import authors, canonical, crazypad, imrclab, ulog, usd, usd_old
from airtouch.logs.table import Sheet, names_of, sheet

PIECE_BYTES = 1 << 14  #: bytes read or unpacked at a time

ENDINGS = (".csv", ".csv.gz", ".parquet", ".usd", ".bin", ".ulg")  #: of the files in a folder that count as flights
STREAMS = ("/dev/null", "/dev/stdout")  #: that are written to as they are
PARQUET = b"PAR1"  #: first bytes of a Parquet file
MANIFEST = "manifest.csv"  #: of a folder: one row a flight, with the condition in which it was flown
REQUEST, FAILED = "run.json", "diverged.jsonl"  #: of a folder of simulated flights (`simulation.workers.store`)


def read(path: str | Path) -> FlightLog:
    """The flight log in a file of any known format, gzipped or not, or in the folder of a ROS 2 bag.

    The content decides on the format, not the name. Raises AirTouchError with file, place and remedy
    for a file that cannot be read.
    """
    if os.path.isdir(path):  # Path.is_dir raises for a name that is too long
        from airtouch.logs.formats import rosbag

        if rosbag.is_bag(path):
            return without_impossible_values(rosbag.read(path))
    return parse(_bytes(path), str(path))


def parse(data: bytes, source: str) -> FlightLog:
    """The flight log in a file's bytes. `source` is its name in messages.

    Impossible values and times become NaN, with a warning (`readings.without_impossible_values`).
    """
    notes: list[str] = []
    data = unzip(data, source, notes)
    with np.errstate(invalid="ignore", over="ignore"):  # `without_impossible_values` handles the infinities
        log = _by_content(data, source)
    log.meta["warnings"] = notes + log.meta["warnings"]
    return without_impossible_values(log)


def load_bytes(path: str | Path) -> bytes:
    """A file's bytes, unpacked if it is gzipped. Raises AirTouchError as `read` does."""
    return unzip(_bytes(path), str(path), [])


def load_text(path: str | Path, warnings: list[str]) -> bytes:
    """A text file's bytes, unpacked if it is gzipped, with LF line ends. Raises AirTouchError as `read` does.

    warnings: gets one if the gzip file is cut off.
    """
    return _text(unzip(_bytes(path), str(path), warnings), str(path))


def read_text(path: str | Path) -> str:
    """The text of a file in UTF-8. Raises AirTouchError for a file that cannot be read and for one that is no text."""
    try:
        return Path(path).read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise AirTouchError(f"{path}: no text in UTF-8 (at byte {error.start}); save it as UTF-8 or give another "
                            "file") from None
    except (OSError, ValueError) as error:
        raise AirTouchError(_unreadable(path, error)) from None


def in_folder(folder: Path, below: bool = False) -> list[Path]:
    """The flight logs of a folder, in order, without its manifest: by the ending of their names, in any case.

    A file without an ending is one if its content is a uSD log, a ULog or Parquet: the card's names are `log00`.
    below: those of the folders in it too. Raises AirTouchError for a folder that cannot be listed.
    """
    return [p for p in _files_of(folder, below) if _is_flight(p)]


def flights_in(folder: Path) -> list[Path]:
    """The flight logs of a folder, as `in_folder` has them. Raises AirTouchError for a folder without any."""
    flights = in_folder(folder)
    if not flights:
        others = ignored(folder)
        beside = f"; of {others} other files none is a uSD log" if others else ""
        raise AirTouchError(f"{folder}: no flights in this folder ({', '.join(ENDINGS)}){beside}")
    return flights


def ignored(folder: Path) -> int:
    """Number of files in a folder that are no flight logs, without hidden ones and those that AirTouch puts beside."""
    return sum(not _is_flight(p) for p in _files_of(folder)
               if p.name not in (MANIFEST, REQUEST, FAILED) and not p.name.startswith("."))


def _files_of(folder: Path, below: bool = False) -> list[Path]:
    try:
        return sorted(p for p in (folder.rglob("*") if below else folder.iterdir()) if p.is_file())
    except OSError as error:
        raise AirTouchError(f"{folder}: cannot be listed: {error.strerror}; check its rights") from None


def _is_flight(path: Path) -> bool:
    """True for a file whose ending, or without one whose first bytes, are those of a flight log."""
    if path.suffix or path.name.startswith("."):
        return path.name.lower().endswith(ENDINGS) and path.name != MANIFEST
    try:
        with path.open("rb") as file:
            first = file.read(PIECE_BYTES)
    except OSError:
        return False
    return first[:4] == PARQUET or first[:7] == ulog.MAGIC or first[:1] == bytes([usd.MAGIC]) or usd_old.matches(first)


def write(log: FlightLog, path: str | Path, force: bool = False) -> None:
    """Write a flight log as canonical CSV (`.csv`, `.csv.gz`) or Parquet (`.parquet`), by the ending of the name.

    The file is written whole or not at all. Raises AirTouchError for another ending, for a file that
    exists (without `force`) and for a folder that cannot be written to.
    """
    name = Path(path).name
    if name.endswith((".csv", ".csv.gz")):
        data = canonical.to_bytes(log, compress=name.endswith(".gz"))
    elif name.endswith(".parquet"):
        from airtouch.logs.formats import parquet

        data = parquet.to_bytes(log)
    else:
        raise AirTouchError(f"{path}: unknown kind of file; end the name in .csv, .csv.gz or .parquet")
    write_bytes(data, Path(path), force)


def make_folder(folder: Path) -> None:
    """Make a folder, with those above it, if it is not there. Raises AirTouchError where that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise AirTouchError(f"{folder}: cannot be made: {error.strerror}; choose another") from None


@contextmanager
def no_empty_folders(out: Path) -> Iterator[None]:
    """Remove, at the end of a `with` statement, `out` and the folders above it if it made them and they are empty."""
    absent = [folder for folder in (out, *out.parents) if not folder.exists()]
    try:
        yield
    finally:
        for folder in absent:
            with suppress(OSError):  # it holds something
                folder.rmdir()


def check_free(path: Path | None, force: bool) -> None:
    """Raise AirTouchError for a file that `write_bytes` would refuse, and a folder that cannot be made or written to.

    Call it before the work, so that a long run does not end in a refusal.
    """
    if path is None or str(path) in STREAMS:
        return
    target = _target(path, force)
    make_folder(target.parent)
    try:  # rights alone do not tell: a file system may refuse root as well
        tempfile.TemporaryFile(dir=target.parent).close()
    except OSError as error:
        raise AirTouchError(f"{target.parent}: cannot be written to: {error.strerror}; "
                            "choose another folder") from None


def write_bytes(data: bytes, path: Path, force: bool = False) -> None:
    """Write bytes to a temporary file beside `path` and rename it; a link stays, and the file it leads to is written.

    Data for `/dev/null` and `/dev/stdout` go there. Raises AirTouchError as `write` does, and for any other device or
    pipe.
    """
    temporary = None
    try:
        if str(path) in STREAMS:
            with open(path, "ab", buffering=0) as stream:
                stream.write(data)
            return
        target = _target(path, force)
        temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
        with temporary.open("xb") as file:
            file.write(data)
        temporary.replace(target)
    except OSError as error:
        if temporary and os.path.exists(temporary):  # Path.exists raises for a name that is too long
            os.unlink(temporary)
        raise AirTouchError(f"{path}: cannot be written: {error.strerror}") from None


def _target(path: Path, force: bool) -> Path:
    """The file that a path, through links, leads to. Raises AirTouchError where it must not be replaced."""
    if os.path.isdir(path):
        raise AirTouchError(f"{path}: is a folder; give the name of a file")
    if os.path.exists(path):
        if not os.path.isfile(path):
            raise AirTouchError(f"{path}: is a device or a pipe, not a file; give the name of a file")
        if not force:
            raise AirTouchError(f"{path}: exists already; use --force to replace it")
    return Path(os.path.realpath(path))


def _by_content(data: bytes, source: str) -> FlightLog:
    """The log in a file's bytes; the first of them tell the format."""
    if not data or data.isspace():
        raise AirTouchError(f"{source}: the file is empty; log the flight again or leave it out")
    if data[:4] == PARQUET:
        from airtouch.logs.formats import parquet

        return parquet.read(data, source)
    if data[:7] == ulog.MAGIC:
        return ulog.read(data, source)
    if data[0] == usd.MAGIC:
        return usd.read(data, source)
    if usd_old.matches(data):
        return usd_old.read(data, source)
    return _by_header(sheet(_text(data, source)), source)


def _text(data: bytes, source: str) -> bytes:
    """A text's bytes with LF line ends."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise AirTouchError(f"{source}: text in UTF-16; save it as UTF-8 (in PowerShell: -Encoding utf8)")
    if b"\x00" in data:
        raise AirTouchError(f"{source}: binary data of no known kind; give a uSD log, Parquet or CSV")
    return data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def _bytes(path: str | Path) -> bytes:
    """A file's bytes. Raises AirTouchError beyond 1 GiB, also for pipes and devices, whose size is not known before."""
    parts: list[bytes] = []
    try:
        with open(path, "rb") as file:
            while len(parts) <= LARGEST_BYTES // PIECE_BYTES and (piece := file.read(PIECE_BYTES)):
                parts.append(piece)
    except (OSError, ValueError) as error:
        raise AirTouchError(_unreadable(path, error)) from None
    if len(parts) > LARGEST_BYTES // PIECE_BYTES:
        raise AirTouchError(f"{path}: more than 1 GiB is too large for a flight log; split it")
    return b"".join(parts)


def _unreadable(path: str | Path, error: Exception) -> str:
    reason = getattr(error, "strerror", None) or error
    return f"{path}: cannot be read: {reason}; check the name and the rights"


def _by_header(text: Sheet, source: str) -> FlightLog:
    """The log in a CSV; the header line tells the format. Raises AirTouchError for an unknown one."""
    if not text.first:
        raise AirTouchError(f"{source}: only comments, no data; log the flight again or leave it out")
    names = names_of(text.first)
    if all(map(_numeric, names)):
        return authors.read(text, source)
    if any(name in COLUMNS for name in names):
        return canonical.read(text, source)
    if crazypad.matches(names):
        return crazypad.read(text, source)
    if imrclab.matches(names):
        return imrclab.read(text, source)
    if {"pwm", "vbat[V]", "rpm1"} <= set(names):
        raise AirTouchError(f"{source}: a thrust-stand run, not a flight; leave it out")
    if {"file", "use"} <= set(names):
        raise AirTouchError(f"{source}: a list of flights, not a flight; name its folder")
    header = printable(text.first[:200].decode("utf-8", "replace"), 60)
    raise AirTouchError(f"{source}:{text.line}: unknown header '{header}'; "
                        "name the columns as in the table of columns")


def _numeric(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def unzip(data: bytes, source: str, notes: list[str]) -> bytes:
    """The data, unpacked if it is gzipped. Of a truncated file it is what can be unpacked, with a warning in `notes`.

    Raises AirTouchError for damaged data and for more than 1 GiB unpacked.
    """
    if data[:2] != b"\x1f\x8b":
        return data
    parts: list[bytes] = []
    total, place, stream = 0, 0, zlib.decompressobj(wbits=31)
    while place < len(data):
        piece = data[place:place + PIECE_BYTES]
        try:
            parts.append(stream.decompress(piece, LARGEST_BYTES - total + 1))
        except zlib.error as error:
            raise AirTouchError(f"{source}: the gzip data is damaged ({error}); "
                                "copy the file again") from None
        total += len(parts[-1])
        if total > LARGEST_BYTES:
            raise AirTouchError(f"{source}: unpacks to more than 1 GiB, which no flight log does; split it")
        place += len(piece) - len(stream.unused_data)
        if stream.eof:
            if data[place:place + 2] != b"\x1f\x8b":
                break
            stream = zlib.decompressobj(wbits=31)
    if not stream.eof:
        notes.append("the gzip file is cut off; what could be unpacked was read")
    return b"".join(parts)
