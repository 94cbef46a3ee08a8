"""Numeric text tables: read in bulk, and when that fails the line that is wrong is found."""

import re
from io import BytesIO

import numpy as np

from airtouch.errors import AirTouchError

_EMPTY_CELL = re.compile(rb"(?<=,)(?=[,\n])|(?<=\n)(?=,)")


def split_header(text: bytes) -> tuple[list[bytes], bytes, bytes, int]:
    """Leading comment lines, the first line that is none, what follows, and that line's number.

    Blank lines before it are skipped; without such a line it and the rest are empty.
    """
    comments: list[bytes] = []
    place, number = 0, 1
    while place < len(text):
        end = text.find(b"\n", place)
        end = len(text) if end < 0 else end
        line = text[place:end].strip()
        if line and not line.startswith(b"#"):
            return comments, text[place:end], text[end + 1:], number
        if line:
            comments.append(line)
        place, number = end + 1, number + 1
    return comments, b"", b"", number


def names_of(header: bytes) -> list[str]:
    """The column names in a header line."""
    return [name.strip() for name in header.decode("utf-8", "replace").split(",")]


def parse_table(body: bytes, source: str, columns: int, first_line: int,
                warnings: list[str]) -> np.ndarray:
    """Comma-separated numbers as a float64 array of shape (rows, columns).

    body: the rows, line ends already LF; `first_line` is its first line's number
    in the file, for messages. Empty cells become NaN, blank lines are skipped. A
    last line that is cut off is dropped and said so in `warnings`. Raises
    AirTouchError that names file and line for any other bad cell or row.
    """
    cut = not body.endswith(b"\n")
    if cut and body.rpartition(b"\n")[2].endswith(b","):  # an unfinished row, not an empty cell
        body = _without_last_line(body, source, first_line, warnings)
    if not body.strip():
        raise AirTouchError(f"{source}: no complete row of data; log the flight again or leave the file out")
    if b",," in body or b",\n" in body or b"\n," in body or body.startswith(b","):
        body = _EMPTY_CELL.sub(b"nan", b"\n" + body)[1:]
    table = _bulk(body, columns)
    if table is not None:
        return table
    bad_line, problem, is_last = _first_problem(body, columns)
    if is_last:
        shorter = _without_last_line(body, source, first_line, warnings)
        table = _bulk(shorter, columns) if shorter.strip() else None
        if table is not None:
            return table
    raise AirTouchError(f"{source}:{first_line + bad_line}: {problem}; correct or delete that line")


def _bulk(body: bytes, columns: int) -> np.ndarray | None:
    """The whole table by NumPy's parser, None where it is not rectangular numbers."""
    try:
        table = np.loadtxt(BytesIO(body), delimiter=",", ndmin=2, comments=None)
    except ValueError:
        return None
    return table if table.shape[1] == columns else None


def _first_problem(body: bytes, columns: int) -> tuple[int, str, bool]:
    """Line offset of the first bad row, what is wrong, and whether it is the last row."""
    lines = body.split(b"\n")
    last = max((i for i, line in enumerate(lines) if line.strip()), default=0)
    for i, line in enumerate(lines):
        if not line.strip():
            continue
        cells = line.split(b",")
        if len(cells) != columns:
            return i, f"{len(cells)} cells where {columns} are expected", i == last
        for number, cell in enumerate(cells, start=1):
            if not _is_number(cell):
                shown = cell.strip()[:20].decode("ascii", "replace")
                return i, f"cell {number} holds {shown!r}, not a number", i == last
    return 0, "not a table of numbers", False


def _is_number(cell: bytes) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return b"_" not in cell


def _without_last_line(body: bytes, source: str, first_line: int, warnings: list[str]) -> bytes:
    kept, newline, _ = body.rstrip(b"\n").rpartition(b"\n")
    number = first_line + kept.count(b"\n") + (1 if newline else 0)
    warnings.append(f"line {number} is cut off and was dropped")
    return kept + newline
