"""Tables of numbers as text. They are read in bulk; if that fails, the bad line is located for the message."""

import re
from io import BytesIO
from typing import NamedTuple

import numpy as np

from airtouch.errors import AirTouchError, printable

MOST_COLUMNS = 256  #: columns that a log may have
LONGEST_NAME = 100  #: characters of a column's name
_EMPTY_CELL = re.compile(rb"(?<=,)(?=[,\n])|(?<=\n)(?=,)")
_BLANK = re.compile(rb"(?<=\n)[^\S\n]+(?=\n|\Z)")
_HEAD = re.compile(rb"(?:[^\S\n]*+(?:#[^\n]*+)?\n)*+")  # blank lines and comments
_COMMENT = re.compile(rb"#[^\n]*")


class Sheet(NamedTuple):
    """A text in parts: leading comment lines, the first other line, its line end, the rest, and that line's number.

    Without an other line it and the rest are empty. The line end is LF, or empty in a truncated text.
    """

    comments: list[bytes]
    first: bytes
    end: bytes
    rest: bytes
    line: int


def sheet(text: bytes) -> Sheet:
    """The parts of a text with LF line ends. Blank lines before the first line that is no comment are left out."""
    match = _HEAD.match(text)
    head = match.group() if match else b""
    first, end, rest = text[len(head):].partition(b"\n")
    comments = [line.strip() for line in _COMMENT.findall(head)]
    if first.lstrip().startswith(b"#"):
        comments.append(first.strip())
    if first.lstrip()[:1] in (b"", b"#"):
        first = b""
    return Sheet(comments, first, end, rest, head.count(b"\n") + 1)


def names_of(header: bytes) -> list[str]:
    """The column names in a header line; beyond 256 the rest is one name, which `check_names` refuses."""
    return [name.strip() for name in header.decode("utf-8", "replace").split(",", MOST_COLUMNS)]


def check_names(names: list[str], place: str, before: int = 0) -> None:
    """Raise AirTouchError for more than 256 columns and for a name that is empty, repeated, long or not printable.

    before: number of columns before the first name.
    """
    if len(names) > MOST_COLUMNS:
        raise AirTouchError(f"{place}: more than {MOST_COLUMNS} columns; leave out those that are no readings")
    for i, name in enumerate(names):
        fault = ("has no name" if not name.strip() else "is not printable" if not name.isprintable() else
                 "has too long a name" if len(name) > LONGEST_NAME else
                 "has another one's name" if name in names[:i] else "")
        if fault:
            raise AirTouchError(f"{place}: column {before + i + 1} {fault} ('{printable(name)}'); "
                                "give each its own short name")


def named_table(text: Sheet, source: str, warnings: list[str]) -> dict[str, np.ndarray]:
    """The columns (n,) of a CSV with a header, by name.

    A first column without a name is left out: pandas writes its row numbers there.
    Raises AirTouchError for names that `check_names` and rows that `parse_table` refuses.
    """
    names = names_of(text.first)
    unnamed = int(len(names) > 1 and not names[0])
    check_names(names[unnamed:], f"{source}:{text.line}", unnamed)
    rows = parse_table(text.rest, source, len(names), text.line + 1, warnings)
    return dict(zip(names[unnamed:], np.ascontiguousarray(rows.T[unnamed:]), strict=True))


def parse_table(body: bytes, source: str, columns: int, first_line: int,
                warnings: list[str]) -> np.ndarray:
    """Comma-separated numbers as a float64 array (rows, columns).

    body: the rows, with LF line ends. first_line: the number of its first line in the file.
    Empty cells become NaN, blank lines are skipped. A truncated last line is dropped, with a
    warning: one without a line end, as its last number may lack digits, or else a bad one. Raises
    AirTouchError with file and line for any other bad cell or row.
    """
    complete = without_cut_line(body, first_line, warnings)
    cut, body = complete != body, complete
    if not body or body.isspace():
        raise AirTouchError(f"{source}: no complete row of data; log the flight again or leave the file out")
    if b",," in body or b",\n" in body or b"\n," in body or body.startswith(b","):
        body = _EMPTY_CELL.sub(b"nan", b"\n" + body)[1:]
    table = _bulk(body, columns)
    if table is None and _BLANK.search(b"\n" + body):  # NumPy skips empty lines only
        body = _BLANK.sub(b"", b"\n" + body)[1:]
        table = _bulk(body, columns)
    if table is not None:
        return table
    bad_line, problem, is_last = _first_problem(body, columns)
    if is_last and not cut:
        shorter = _without_last_line(body, first_line, warnings)
        table = None if shorter.isspace() or not shorter else _bulk(shorter, columns)
        if table is not None:
            return table
    raise AirTouchError(f"{source}:{first_line + bad_line}: {problem}; correct or delete that line")


def without_cut_line(body: bytes, first_line: int, warnings: list[str]) -> bytes:
    """The text without a last line that has no line end, as its last number may lack digits; a warning names it.

    first_line: the number of its first line in the file.
    """
    return _without_last_line(body, first_line, warnings) if body.rpartition(b"\n")[2].strip() else body


def _bulk(body: bytes, columns: int) -> np.ndarray | None:
    """The whole table (rows, columns) by NumPy's parser; None if it is not a rectangular table of numbers."""
    try:
        table = np.loadtxt(BytesIO(body), delimiter=",", ndmin=2, comments=None)
    except ValueError:
        return None
    return table if table.shape[1] == columns else None


def _first_problem(body: bytes, columns: int) -> tuple[int, str, bool]:
    """Line offset of the first bad row, the fault, and whether it is the last row."""
    last = len(body.rstrip())
    place = 0
    for i, line in enumerate(BytesIO(body)):
        place += len(line)
        if line.isspace():
            continue
        cells = line.count(b",") + 1
        if cells != columns:
            return i, f"{cells} cells where {columns} are expected", place >= last
        for number, cell in enumerate(line.split(b","), start=1):
            if not _is_number(cell):
                text = printable(cell.strip()[:80].decode("ascii", "replace"), 20)
                return i, f"cell {number} holds '{text}', not a number", place >= last
    return 0, "not a table of numbers", False


def _is_number(cell: bytes) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return b"_" not in cell


def _without_last_line(body: bytes, first_line: int, warnings: list[str]) -> bytes:
    rest, newline, _ = body.rstrip(b"\n").rpartition(b"\n")
    number = first_line + rest.count(b"\n") + (1 if newline else 0)
    warnings.append(f"line {number} is cut off and was dropped")
    return rest + newline
