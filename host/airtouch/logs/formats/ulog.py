"""PX4 ULog files, read by `pyulog` (extra 'ulog').

PX4: body axes forward, right, down; world axes north, east, down; motors 1 front right, 2 rear left, 3 front left,
4 rear right. A FlightLog: y left, z up; motors 1 front right, 2 rear right, 3 rear left, 4 front left.
"""

import io

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.extras import need
from airtouch.logs.alignment import Signal, aligned_log
from airtouch.logs.flight_log import ACC, ATTITUDE, GYRO, POSITION, PWM, VELOCITY, FlightLog
from airtouch.logs.quaternion import euler

MAGIC = b"ULog\x01\x12\x35"
FLIP = (1.0, -1.0, -1.0)  #: signs from forward, right, down to forward, left, up
MOTORS = (0, 3, 1, 2)  #: PX4's index, from 0, of a FlightLog's motors 1 to 4
DOWN = 25  #: orientation of a distance sensor that looks down, MAV_SENSOR_ROTATION_PITCH_270
TOPICS = ("sensor_combined", "vehicle_attitude", "vehicle_local_position", "distance_sensor", "battery_status",
          "actuator_motors", "actuator_outputs")


def read(data: bytes, source: str) -> FlightLog:
    """The flight log of a ULog file, at 100 Hz.

    Motors are those of `actuator_motors` (0 to 1) or, without that topic, of `actuator_outputs` (1000 to 2000 us),
    scaled to 0..65535. The down range is that of the first distance sensor that looks down; readings that PX4 marks
    as invalid are NaN. Raises AirTouchError without the extra 'ulog' and for a file without an IMU.
    """
    need("ulog", f"{source}: reading PX4 logs")
    from pyulog import ULog

    try:
        instances = ULog(io.BytesIO(data), list(TOPICS)).data_list
    except Exception as error:  # a damaged file makes the library raise any of many
        raise AirTouchError(f"{source}: not a whole ULog file: {type(error).__name__}: {error}") from None
    topics = {d.name: d.data for d in reversed(instances)}  # the first instance counts
    ranges = [d.data for d in instances if d.name == "distance_sensor"]
    down = [table for table in ranges if _looks_down(table)]
    warnings = []
    if ranges:
        topics["distance_sensor"] = _valid_range(down[0]) if down else {}
        if not down:
            warnings.append("zrange_m is left out: no distance_sensor looks down (orientation 25)")
    signals: dict[str, Signal] = {}

    def add(topic: str, names: tuple[str, ...], fields: tuple[str, ...], signs: tuple[float, ...]) -> None:
        table = topics.get(topic, {})
        for name, field, sign in zip(names, fields, signs, strict=True):
            if field in table:
                signals[name] = table["timestamp"] * 1e-6, sign * np.asarray(table[field], float)

    add("sensor_combined", ACC, tuple(f"accelerometer_m_s2[{i}]" for i in range(3)), FLIP)
    add("sensor_combined", GYRO, tuple(f"gyro_rad[{i}]" for i in range(3)), FLIP)
    add("vehicle_local_position", POSITION, ("x", "y", "z"), FLIP)
    add("vehicle_local_position", VELOCITY, ("vx", "vy", "vz"), FLIP)
    add("distance_sensor", ("zrange_m",), ("current_distance",), (1.0,))
    add("battery_status", ("vbat_V",), ("voltage_v",), (1.0,))
    if "q[0]" in topics.get("vehicle_attitude", {}):
        table = topics["vehicle_attitude"]
        w, x, y, z = (np.asarray(table[f"q[{i}]"], float) for i in range(4))
        turned = np.column_stack([x, -y, -z, w])  # both frames are turned by half a turn about x
        signals |= {name: (table["timestamp"] * 1e-6, v) for name, v in zip(ATTITUDE, euler(turned), strict=True)}
    signals |= _motors(topics)
    return aligned_log(signals, {"source": source, "format": "ulog", "vehicle": "", "acc_frame": "body",
                                 "warnings": warnings})


def _looks_down(table: dict) -> bool:
    """True for a distance sensor whose orientation is DOWN, or is not logged."""
    return "orientation" not in table or bool((np.asarray(table["orientation"]) == DOWN).all())


def _valid_range(table: dict) -> dict:
    """The table of a distance sensor with NaN for its invalid readings, by the fields of PX4's DistanceSensor message.

    Invalid: a signal quality of 0 (-1 is unknown), or a distance outside of the sensor's limits, where they are set.
    """
    if "current_distance" not in table:
        return table
    distance = np.asarray(table["current_distance"], float)
    invalid = np.asarray(table.get("signal_quality", np.full(len(distance), -1))) == 0
    if "min_distance" in table and "max_distance" in table:
        least, most = np.asarray(table["min_distance"], float), np.asarray(table["max_distance"], float)
        invalid |= (most > least) & ((distance < least) | (distance > most))
    return {**table, "current_distance": np.where(invalid, np.nan, distance)}


def _motors(topics: dict) -> dict[str, Signal]:
    """The signals of the four motors, PWM; none where neither topic has them."""
    for topic, field, low, high in (("actuator_motors", "control", 0.0, 1.0),
                                    ("actuator_outputs", "output", 1000.0, 2000.0)):
        table = topics.get(topic, {})
        if all(f"{field}[{i}]" in table for i in MOTORS):
            share = [np.clip((np.asarray(table[f"{field}[{i}]"], float) - low) / (high - low), 0.0, 1.0)
                     for i in MOTORS]
            return {name: (table["timestamp"] * 1e-6, np.nan_to_num(65535.0 * s))
                    for name, s in zip(PWM, share, strict=True)}
    return {}
