"""The paper's authors' headerless CSV logs, told apart by their number of columns."""

import re
from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import ACC, ACC_WORLD, ATTITUDE, GYRO, PWM, FlightLog
from airtouch.logs.quaternion import decompress, euler, to_body
from airtouch.logs.table import Sheet, parse_table
from airtouch.logs.units import GRAVITY, GYRO_LSB, down_range_m, side_range_m

#: columns in a row -> its channels; those of the world frame are in mm/s^2, gravity included
LAYOUTS = {
    6: ("qx", "qy", "qz", "qw", "quat", "t"),
    8: ("acc_g",) * 3 + ("gyro_dps",) * 3 + ("t", "zrange"),
    9: ("gyro_lsb",) * 3 + ("pwm",) * 4 + ("t", "zrange"),
    12: ("acc_world",) * 3 + ("gyro_lsb",) * 3 + ("pwm",) * 4 + ("t", "zrange"),
    13: ("acc_world",) * 3 + ("gyro_lsb",) * 3 + ("pwm",) * 4 + ("quat", "t", "zrange"),
    14: ("acc_world",) * 3 + ("gyro_lsb",) * 3 + ("pwm",) * 4 + ("left", "right", "t", "zrange"),
}


def read(text: Sheet, source: str) -> FlightLog:
    """The FlightLog of an authors' CSV. The number of columns tells the layout (`LAYOUTS`).

    12, 13 and 14 columns give `acc_world_*`. With the quaternion of the 13-column layout
    `acc_*` are in the body frame. Otherwise they repeat the world values, and
    meta["acc_frame"] and a warning say so. Raises AirTouchError for other widths
    and for rows that are not numbers.
    """
    width = text.first.count(b",") + 1
    if width not in LAYOUTS:
        known = ", ".join(str(n) for n in LAYOUTS)
        raise AirTouchError(f"{source}:{text.line}: {width} columns without a header; "
                            f"known layouts have {known}; "
                            "add a header with column names as `airtouch logs convert` writes them")
    warnings: list[str] = []
    rows = parse_table(text.first + text.end + text.rest, source, width, text.line, warnings)
    layout = LAYOUTS[width]
    raw = {kind: rows[:, [i for i, k in enumerate(layout) if k == kind]] for kind in set(layout)}
    columns = {"t_s": raw["t"][:, 0]}
    meta = {"source": source, "format": f"authors-{width}", "vehicle": "crazyflie-2.1-flow",
            "condition": _condition(source), "sample_period_s": 0.01, "warnings": warnings}
    if "quat" in raw:
        q = rows[:, :4] if width == 6 else decompress(raw["quat"][:, 0])
        columns |= dict(zip(ATTITUDE, euler(q), strict=True))
    if "acc_g" in raw:
        columns |= dict(zip(ACC, raw["acc_g"].T * GRAVITY, strict=True))
        columns |= dict(zip(GYRO, np.deg2rad(raw["gyro_dps"].T), strict=True))
        meta["acc_frame"] = "body"
    if "acc_world" in raw:
        world = raw["acc_world"] * 1e-3
        columns |= dict(zip(ACC_WORLD, world.T, strict=True))
        columns |= dict(zip(ACC, _body(world, columns, meta).T, strict=True))
        if len(rows) > 1 and np.array_equal(raw["acc_world"], raw["gyro_lsb"]):
            warnings.append("the gyro columns repeat the accelerations; the rates were not logged")
    if "gyro_lsb" in raw:
        columns |= dict(zip(GYRO, raw["gyro_lsb"].T * GYRO_LSB, strict=True))
        columns |= dict(zip(PWM, raw["pwm"].T, strict=True))
    for kind, name in (("left", "range_left_m"), ("right", "range_right_m")):
        if kind in raw:
            columns[name] = side_range_m(raw[kind][:, 0])
    if "zrange" in raw:
        columns["zrange_m"] = down_range_m(raw["zrange"][:, 0])
    return FlightLog(columns, meta)


def _body(world: np.ndarray, columns: dict[str, np.ndarray], meta: dict) -> np.ndarray:
    if ATTITUDE[0] in columns:
        meta["acc_frame"] = "body"
        return to_body(world, *(columns[name] for name in ATTITUDE))
    meta["acc_frame"] = "world"
    meta["warnings"].append("no attitude logged: acc_* are in the world frame, not in the body's")
    return world


def _condition(source: str) -> str:
    """The condition in a file's name, after date and time: `h79`, `+10d`, `windR` or ""."""
    match = re.match(r"imu_data_\d{4}-\d{4}_?(.*?)\.csv", Path(source).name)
    return match.group(1) if match else ""
