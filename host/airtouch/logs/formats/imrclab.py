"""IMRCLab's CSVs: flights at 500 Hz with pose, rpm and battery. Thrust-stand runs: see thrust_stand.py."""

import re
from pathlib import Path

from airtouch.logs.flight_log import FlightLog
from airtouch.logs.formats.crazypad import read_variables
from airtouch.logs.table import Sheet
from airtouch.logs.variables import ASSUMED


def matches(names: list[str]) -> bool:
    """True for the header of a flight: Crazyflie log variables with a gyro or a pose."""
    return "timestamp_ms" in names and any("." in name for name in names)


def read(text: Sheet, source: str) -> FlightLog:
    """The FlightLog of an IMRCLab flight. Pose and velocity are the on-board estimate."""
    meta = {"source": source, "format": "crazyflie-csv", **ASSUMED, "condition": "", "warnings": []}
    match = re.match(r"brushed_(\w+)\.csv", Path(source).name)
    if match:
        meta |= {"condition": match.group(1), "format": "imrclab"}
        del meta["assumed_vehicle"]  # their brushed drone
    return read_variables(text, source, meta)
