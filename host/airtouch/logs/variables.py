"""Crazyflie log variables (`acc.x`, `stateEstimate.vz`, ...) as columns of the schema.

Units and frames: crazyflie-firmware's logging variables (acc in g, gyro in deg/s,
`stateEstimate.pitch` with the legacy, inverted sign, `stateEstimate.a*` in g in the
world frame without gravity, `stateEstimateZ.*` in mm with gravity).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from airtouch.logs.flight_log import (
    ACC,
    ACC_WORLD,
    ATTITUDE,
    AXES,
    GYRO,
    POSITION,
    PWM,
    RANGES,
    RPM,
    VELOCITY,
)
from airtouch.logs.quaternion import decompress, euler, rotation, to_body
from airtouch.logs.units import GRAVITY, GYRO_LSB, down_range_m, side_range_m

#: metadata on the vehicle of a log that does not say which flew: `assumed_vehicle` makes `vehicle.of_log` warn
ASSUMED = {"vehicle": "crazyflie-2.1", "assumed_vehicle": "crazyflie-2.1"}
_DEGREE = np.pi / 180.0
_MOTORS = (1, 2, 3, 4)

#: (variables, columns, factor); of several for the same columns the first whose variables are all logged is used
_GROUPS = (
    (tuple(f"acc.{a}" for a in AXES), ACC, GRAVITY),
    (tuple(f"gyro.{a}" for a in AXES), GYRO, _DEGREE),
    (tuple(f"gyro.{a}Raw" for a in AXES), GYRO, GYRO_LSB),
    (tuple(f"pwm.m{i}_pwm" for i in _MOTORS), PWM, 1.0),
    (tuple(f"motor.m{i}" for i in _MOTORS), PWM, 1.0),
    (tuple(f"rpm.m{i}" for i in _MOTORS), RPM, 1.0),
    (tuple(f"stateEstimate.{a}" for a in AXES), POSITION, 1.0),
    (tuple(f"stateEstimateZ.{a}" for a in AXES), POSITION, 1e-3),
    (tuple(f"stateEstimate.v{a}" for a in AXES), VELOCITY, 1.0),
    (tuple(f"stateEstimateZ.v{a}" for a in AXES), VELOCITY, 1e-3),
)
#: groups of variables that give nothing without all of them: motors, and what is turned into other axes
_WHOLE = (
    *(variables for variables, columns, _ in _GROUPS if columns in (PWM, RPM)),
    *(tuple(f"{group}.a{a}" for a in AXES) for group in ("stateEstimate", "stateEstimateZ")),
    tuple(f"stateEstimate.q{a}" for a in ("x", "y", "z", "w")),
    tuple(f"stateEstimateZ.rate{a}" for a in ("Roll", "Pitch", "Yaw")),
)
_SINGLE = (
    ("pm.vbat", "vbat_V", 1.0),
    ("pm.vbatMV", "vbat_V", 1e-3),
    ("stateEstimate.roll", ATTITUDE[0], _DEGREE),
    ("stateEstimate.pitch", ATTITUDE[1], -_DEGREE),
    ("stateEstimate.yaw", ATTITUDE[2], _DEGREE),
)


def to_columns(table: Mapping[str, np.ndarray], meta: dict[str, Any]) -> dict[str, np.ndarray]:
    """The schema's columns of a table {log variable: (n,) float64}, in SI units.

    Sets meta["acc_frame"] if there is an acceleration. Variables without a column in the schema
    are left out. Of a group that is not logged whole each axis has its column, unless it needs the
    others; a warning names those that are left out.
    """
    columns: dict[str, np.ndarray] = {}
    for variables, names, factor in _GROUPS:
        if names[0] not in columns and all(v in table for v in variables):
            columns |= {name: table[v] * factor for v, name in zip(variables, names, strict=True)}
    for variable, name, factor in _SINGLE:
        if variable in table and name not in columns:
            columns[name] = table[variable] * factor
    if "range.zrange" in table:
        columns["zrange_m"] = down_range_m(table["range.zrange"])
    for name in RANGES:
        variable = f"range.{name.split('_')[1]}"
        if variable in table:
            columns[name] = side_range_m(table[variable])
    _attitude(table, columns)
    _rates(table, columns, meta)
    _acceleration(table, columns, meta)
    _parts(table, columns, meta)
    return columns


def _attitude(table: Mapping[str, np.ndarray], columns: dict[str, np.ndarray]) -> None:
    quaternion = [f"stateEstimate.q{a}" for a in ("x", "y", "z", "w")]
    if all(v in table for v in quaternion):
        columns |= dict(zip(ATTITUDE, euler(np.column_stack([table[v] for v in quaternion])), strict=True))
    elif "stateEstimateZ.quat" in table and not all(name in columns for name in ATTITUDE):
        columns |= dict(zip(ATTITUDE, euler(decompress(table["stateEstimateZ.quat"])), strict=True))


def _rates(table: Mapping[str, np.ndarray], columns: dict[str, np.ndarray], meta: dict[str, Any]) -> None:
    """Add body rates from `stateEstimateZ.rate*` (mrad/s) if no gyro is logged.

    Firmware releases differ in the sign of the pitch rate; the sign that fits the logged attitude is used.
    """
    names = [f"stateEstimateZ.rate{a}" for a in ("Roll", "Pitch", "Yaw")]
    if GYRO[0] in columns or not all(name in table for name in names):
        return
    pitch, turned = 1e-3 * table[names[1]], _pitch_rate(columns)
    fits = float(np.nansum(pitch[1:] * turned)) if turned is not None else 0.0
    if not fits or not np.isfinite(fits):
        meta["warnings"].append("the sign of stateEstimateZ.ratePitch is unknown without attitude: gyro left out")
        return
    columns |= dict(zip(GYRO, (1e-3 * table[names[0]], np.sign(fits) * pitch, 1e-3 * table[names[2]]), strict=True))


def _pitch_rate(columns: dict[str, np.ndarray]) -> np.ndarray | None:
    """Rotation about the body's y axis between rows, (n-1,) rad; 0 where unknown. None without attitude."""
    if not all(name in columns for name in ATTITUDE):
        return None
    r = rotation(*(columns[name] for name in ATTITUDE))
    step = np.einsum("nji,njk->nik", r[:-1], r[1:])
    return np.nan_to_num(0.5 * (step[:, 0, 2] - step[:, 2, 0]))


def _acceleration(table: Mapping[str, np.ndarray], columns: dict[str, np.ndarray],
                  meta: dict[str, Any]) -> None:
    """Add world accelerations if the estimate is logged, and body accelerations from them if no IMU is logged."""
    world = None
    if all(f"stateEstimate.a{a}" in table for a in AXES):
        world = np.column_stack([table[f"stateEstimate.a{a}"] for a in AXES]) * GRAVITY + (0, 0, GRAVITY)
    elif all(f"stateEstimateZ.a{a}" in table for a in AXES):
        world = np.column_stack([table[f"stateEstimateZ.a{a}"] for a in AXES]) * 1e-3
    if world is not None:
        columns |= dict(zip(ACC_WORLD, world.T, strict=True))
    if ACC[0] in columns:
        meta["acc_frame"] = "body"
    elif world is not None and all(name in columns for name in ATTITUDE):
        meta["acc_frame"] = "body"
        columns |= dict(zip(ACC, to_body(world, *(columns[name] for name in ATTITUDE)).T, strict=True))
    elif world is not None:
        meta["acc_frame"] = "world"
        meta["warnings"].append("attitude not fully logged: acc_* are in the world frame, not in the body's")
        columns |= dict(zip(ACC, world.T, strict=True))


def _parts(table: Mapping[str, np.ndarray], columns: dict[str, np.ndarray], meta: dict[str, Any]) -> None:
    """Add the logged axes that have no column yet, of groups that are not logged whole.

    A warning names those whose column others gave, and variables that need others of theirs.
    """
    for variables, names, factor in _GROUPS:
        if variables in _WHOLE or all(v in table for v in variables):
            continue
        for variable, name in zip(variables, names, strict=True):
            if variable in table and name in columns:
                meta["warnings"].append(f"{variable} left out: other variables give {name}")
            elif variable in table:
                columns[name] = table[variable] * factor
                if names == ACC:
                    meta["acc_frame"] = "body"
    for group in _WHOLE:
        logged_ones, missing = [v for v in group if v in table], [v for v in group if v not in table]
        if logged_ones and missing:
            meta["warnings"].append(f"{', '.join(logged_ones)} left out, as {', '.join(missing)} are not logged")
