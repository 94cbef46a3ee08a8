"""CrazyPAD's CSV logs (hover with structural defects; no gyro, no pitch)."""

import re
from pathlib import Path

from airtouch.logs.flight_log import FlightLog
from airtouch.logs.table import Sheet, named_table
from airtouch.logs.variables import ASSUMED, to_columns


def matches(names: list[str]) -> bool:
    """True for CrazyPAD's header: world accelerations and no gyro."""
    return "timestamp_ms" in names and "stateEstimate.ax" in names and "gyro.x" not in names


def read(text: Sheet, source: str) -> FlightLog:
    """The FlightLog of a CrazyPAD CSV. `m*_pwm` are after battery compensation, as sent to the motors."""
    meta = {"source": source, "format": "crazypad", **ASSUMED, "condition": "", "warnings": []}
    match = re.match(r"pad_(.*)_(E\d+)_log\d+", Path(source).name)
    if match:
        meta["condition"], meta["drone"] = match.groups()
        del meta["assumed_vehicle"]  # both drones of CrazyPAD
    return read_variables(text, source, meta)


def read_variables(text: Sheet, source: str, meta: dict) -> FlightLog:
    """The FlightLog of a CSV whose header names Crazyflie log variables and the clock `timestamp_ms`."""
    table = named_table(text, source, meta["warnings"])
    return FlightLog({"t_s": table["timestamp_ms"] * 1e-3} | to_columns(table, meta), meta)
