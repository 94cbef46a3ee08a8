"""CrazyPAD's CSV logs (hover with structural defects; no gyro, no pitch)."""

import re
from pathlib import Path

import numpy as np

from airtouch.logs.flight_log import FlightLog
from airtouch.logs.table import names_of, parse_table, split_header
from airtouch.logs.variables import to_columns


def matches(names: list[str]) -> bool:
    """Whether a header is CrazyPAD's: world accelerations and no gyro."""
    return "timestamp_ms" in names and "stateEstimate.ax" in names and "gyro.x" not in names


def read(text: bytes, source: str) -> FlightLog:
    """A FlightLog; `m*_pwm` are the values after battery compensation, as the motors got them."""
    meta = {"source": source, "format": "crazypad", "vehicle": "crazyflie-2.1", "condition": "",
            "warnings": []}
    match = re.match(r"pad_(.*)_(E\d+)_log\d+", Path(source).name)
    if match:
        meta["condition"], meta["drone"] = match.groups()
    return read_variables(text, source, meta)


def read_variables(text: bytes, source: str, meta: dict) -> FlightLog:
    """A CSV whose header names Crazyflie log variables, with `timestamp_ms` as its clock."""
    _, header, body, line_number = split_header(text)
    names = names_of(header)
    rows = parse_table(body, source, len(names), line_number + 1, meta["warnings"])
    table = dict(zip(names, np.ascontiguousarray(rows.T), strict=True))
    columns = {"t_s": table["timestamp_ms"] * 1e-3} | to_columns(table, meta)
    return FlightLog(columns, meta)
