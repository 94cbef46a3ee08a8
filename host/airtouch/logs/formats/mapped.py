"""CSV files of other programs, read with the help of a TOML file that maps their columns to the schema's.

    vehicle = "mine.toml"
    acc_frame = "body"

    [columns.t_s]
    from = "time_us"
    scale = 1e-6

    [columns.gyro_x_radps]
    from = "imu.gyro.x"      # value = (theirs + offset) * scale
    scale = 0.0174533
"""

import csv
import io
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError, nearest, printable
from airtouch.logs.checks.readings import LARGEST, without_impossible_values
from airtouch.logs.files import load_text
from airtouch.logs.flight_log import COLUMNS, FlightLog
from airtouch.logs.table import without_cut_line

KEYS = ("from", "scale", "offset")
OURS = ("source", "format", "warnings")  #: metadata that the reader sets
MISSING = ("nan", "+nan", "-nan", "na", "n/a", "null", "none")  #: words that other programs write for no value


def load(path: str | Path) -> dict:
    """The column map in a TOML file.

    Raises AirTouchError with a wrong column or key and the nearest right ones, and for a value of a wrong type.
    """
    try:
        table = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise AirTouchError(f"{path}: cannot be read as a column map: {error}") from None
    for key in table:
        if key in OURS:
            raise AirTouchError(f"{path}: {key} is not for a map to say; leave it out")
    if not isinstance(table.get("vehicle", ""), str):
        raise AirTouchError(f"{path}: vehicle is {table['vehicle']!r}, a text is needed")
    columns = table.get("columns")
    if not isinstance(columns, dict) or not columns:
        raise AirTouchError(f"{path}: no [columns.NAME] in it; give one for each column, with from = \"their name\"")
    for name, how in columns.items():
        if name not in COLUMNS:
            raise AirTouchError(f"{path}: [columns.{name}] is no column of the flight log{nearest(name, COLUMNS)}")
        _check_column(how, f"{path}: [columns.{name}]")
    return table


def _check_column(how: Any, place: str) -> None:
    """Raise AirTouchError, with the place, for a column of a map with a wrong key or a value of a wrong type."""
    if not isinstance(how, dict):
        raise AirTouchError(f"{place} is {how!r}; give a table with from = \"their name\"")
    for key in how:
        if key not in KEYS:
            raise AirTouchError(f"{place} has no key {key!r}{nearest(key, KEYS)}")
    if "from" not in how:
        raise AirTouchError(f"{place} needs from = \"their name\"")
    if not isinstance(how["from"], str):
        raise AirTouchError(f"{place}: from is {how['from']!r}, a name in quotation marks is needed")
    for key in ("scale", "offset"):
        value = how.get(key, 1.0)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= LARGEST:
            raise AirTouchError(f"{place}: {key} is {value!r}, a number is needed, without quotation marks")


def read(path: str | Path, mapping: str | Path) -> FlightLog:
    """The flight log of a CSV with a header line, by a column map (a TOML file).

    Cells that are no numbers become NaN; a warning counts them, others the rows that have not as many cells as the
    header and the cells with a line end in them. A last line without a line end is dropped with a warning: its last
    number may lack digits. Raises AirTouchError for columns that the CSV lacks or has twice.
    """
    table = load(mapping)
    warnings: list[str] = []
    rows = _rows(path, warnings)
    if len(rows) < 2:
        raise AirTouchError(f"{path}: no header and complete rows in it")
    header = [name.strip() for name in rows[0]]
    ragged = sum(len(row) != len(header) for row in rows[1:])
    if ragged:
        warnings.append(f"{ragged} of {len(rows) - 1} rows have not the header's number of cells, {len(header)}")
    multiline = [cell for row in rows for cell in row if "\n" in cell]
    if multiline:
        warnings.append(f"cells with a line end in them: {len(multiline)}, the first '{printable(multiline[0], 20)}': "
                        "a quotation mark that is not closed takes the rows after it into one cell")
    columns = {}
    for name, how in table["columns"].items():
        if how["from"] not in header:
            raise AirTouchError(f"{path}: no column {how['from']!r}{nearest(how['from'], header)} ({mapping}: "
                                f"[columns.{name}])")
        if header.count(how["from"]) > 1:
            raise AirTouchError(f"{path}: {header.count(how['from'])} columns are called {how['from']!r} ({mapping}: "
                                f"[columns.{name}]); rename the others")
        place = header.index(how["from"])
        cells = [r[place].strip() if place < len(r) else "" for r in rows[1:]]
        theirs, texts = np.array([_number(cell) for cell in cells]), [cell for cell in cells if _is_text(cell)]
        if texts:
            warnings.append(f"{name}: {len(texts)} of {len(cells)} cells are no numbers, the first "
                            f"'{printable(texts[0], 20)}'; taken as missing")
        with np.errstate(invalid="ignore", over="ignore"):
            columns[name] = (theirs + how.get("offset", 0.0)) * how.get("scale", 1.0)
    meta = {k: v for k, v in table.items() if k != "columns"}
    log = FlightLog({n: columns[n] for n in COLUMNS if n in columns},
                    {"source": str(path), "format": "mapped", "condition": "", "warnings": warnings, **meta})
    return without_impossible_values(log)


def _rows(path: str | Path, warnings: list[str]) -> list[list[str]]:
    """The cells of each complete line of a CSV, without comments and blank lines."""
    text = without_cut_line(load_text(path, warnings), 1, warnings).decode("utf-8", "replace")
    try:
        rows = list(csv.reader(io.StringIO(text)))
    except csv.Error as error:
        raise AirTouchError(f"{path}: cannot be read as CSV: {error}") from None
    return [row for row in rows if row and not row[0].startswith("#")]


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return np.nan


def _is_text(cell: str) -> bool:
    """True for a cell that is neither empty, nor a number, nor a word for a missing one."""
    return bool(cell) and cell.lower() not in MISSING and math.isnan(_number(cell))
