"""IMRCLab's CSVs: flights at 500 Hz with pose, rpm and battery. Thrust-stand runs: see thrust_stand.py."""

import re
from pathlib import Path

from airtouch.logs.crazypad import read_variables
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.table import Sheet


def matches(names: list[str]) -> bool:
    """Whether a header is that of a flight with Crazyflie variables and a gyro or pose."""
    return "timestamp_ms" in names and any("." in name for name in names)


def read(text: Sheet, source: str) -> FlightLog:
    """A FlightLog; pose and velocity are the on-board estimate."""
    meta = {"source": source, "format": "crazyflie-csv", "vehicle": "crazyflie-2.1", "condition": "",
            "warnings": []}
    match = re.match(r"brushed_(\w+)\.csv", Path(source).name)
    if match:
        meta |= {"condition": match.group(1), "format": "imrclab"}
    return read_variables(text, source, meta)
