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
import tomllib
from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError, nearest
from airtouch.logs.checks.readings import without_impossible_values
from airtouch.logs.files import load_text
from airtouch.logs.flight_log import COLUMNS, FlightLog

KEYS = ("from", "scale", "offset")


def load(path: str | Path) -> dict:
    """The column map in a TOML file. Raises AirTouchError with a wrong column or key and the nearest right ones."""
    try:
        table = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise AirTouchError(f"{path}: cannot be read as a column map: {error}") from None
    columns = table.get("columns")
    if not isinstance(columns, dict) or not columns:
        raise AirTouchError(f"{path}: no [columns.NAME] in it; give one for each column, with from = \"their name\"")
    for name, how in columns.items():
        if name not in COLUMNS:
            raise AirTouchError(f"{path}: [columns.{name}] is no column of the flight log{nearest(name, COLUMNS)}")
        for key in how:
            if key not in KEYS:
                raise AirTouchError(f"{path}: [columns.{name}] has no key {key!r}{nearest(key, KEYS)}")
        if "from" not in how:
            raise AirTouchError(f"{path}: [columns.{name}] needs from = \"their name\"")
    return table


def read(path: str | Path, mapping: str | Path) -> FlightLog:
    """The flight log of a CSV with a header line, by a column map (a TOML file).

    Raises AirTouchError for columns that the CSV lacks.
    """
    table = load(mapping)
    rows = list(csv.reader(io.StringIO(load_text(path).decode("utf-8", "replace"))))
    rows = [r for r in rows if r and not r[0].startswith("#")]
    if len(rows) < 2:
        raise AirTouchError(f"{path}: no header and rows in it")
    header = [name.strip() for name in rows[0]]
    columns = {}
    for name, how in table["columns"].items():
        if how["from"] not in header:
            raise AirTouchError(f"{path}: no column {how['from']!r}{nearest(how['from'], header)} ({mapping}: "
                                f"[columns.{name}])")
        place = header.index(how["from"])
        theirs = np.array([_number(r[place]) if place < len(r) else np.nan for r in rows[1:]])
        columns[name] = (theirs + how.get("offset", 0.0)) * how.get("scale", 1.0)
    meta = {k: v for k, v in table.items() if k != "columns"}
    log = FlightLog({n: columns[n] for n in COLUMNS if n in columns},
                    {"source": str(path), "format": "mapped", "condition": "", "warnings": [], **meta})
    return without_impossible_values(log)


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return np.nan
