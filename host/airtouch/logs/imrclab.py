"""IMRCLab's CSVs: flights at 500 Hz with pose and rpm, and thrust-stand runs."""

import re
from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.crazypad import read_variables
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.table import parse_table

#: thrust-stand header -> column of the table that `thrust_stand` returns
STAND_COLUMNS = {
    "weight[g]": "weight_g", "weight": "weight_g", "pwm": "pwm", "vbat[V]": "vbat_V",
    "rpm1": "rpm_1", "rpm2": "rpm_2", "rpm3": "rpm_3", "rpm4": "rpm_4",
    "v[V]": "voltage_V", "i[A]": "current_A", "p[W]": "power_W",
}


def matches(names: list[str]) -> bool:
    """Whether a header is that of a flight with Crazyflie variables and a gyro or pose."""
    return "timestamp_ms" in names and any("." in name for name in names)


def is_thrust_stand(names: list[str]) -> bool:
    """Whether a header is that of a thrust-stand run."""
    return {"pwm", "vbat[V]", "rpm1"} <= set(names)


def read(text: bytes, source: str) -> FlightLog:
    """A FlightLog; pose and velocity are the on-board estimate."""
    meta = {"source": source, "format": "crazyflie-csv", "vehicle": "crazyflie-2.1", "condition": "", "warnings": []}
    match = re.match(r"brushed_(\w+)\.csv", Path(source).name)
    if match:
        meta |= {"condition": match.group(1), "format": "imrclab"}
    return read_variables(text, source, meta)


def thrust_stand(text: bytes, source: str) -> dict[str, np.ndarray]:
    """A thrust-stand run as named columns (n,): `weight_g`, `pwm`, `vbat_V`, `rpm_1`, ...

    Raises AirTouchError for another header and for rows that are not numbers.
    """
    header, _, body = text.replace(b"\r\n", b"\n").partition(b"\n")
    names = [name.strip() for name in header.decode("utf-8", "replace").split(",")]
    if not is_thrust_stand(names):
        raise AirTouchError(f"{source}:1: not the header of a thrust-stand run")
    rows = parse_table(body, source, len(names), 2, [])
    return {STAND_COLUMNS[n]: rows[:, i] for i, n in enumerate(names) if n in STAND_COLUMNS}
