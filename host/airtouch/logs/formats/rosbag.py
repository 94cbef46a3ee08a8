"""ROS 2 bags (a folder with `metadata.yaml`, sqlite3 or mcap), read by `rosbags` (extra 'ros').

Messages are recognised by their type, not by the name of the topic. Axes are those of REP 103 (x forward, y left,
z up), as in a FlightLog. Motors are an array of four numbers on a topic with "motor", "pwm" or "actuator" in its name.
"""

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.extras import need
from airtouch.logs.alignment import aligned_log
from airtouch.logs.flight_log import ACC, ATTITUDE, GYRO, POSITION, PWM, VELOCITY, FlightLog
from airtouch.logs.quaternion import euler

METADATA = "metadata.yaml"
MOTOR_NAMES = ("motor", "pwm", "actuator")
ARRAYS = ("UInt16MultiArray", "UInt32MultiArray", "Int32MultiArray", "Float32MultiArray", "Float64MultiArray")


def is_bag(path: str | Path) -> bool:
    """True if the path is the folder of a ROS 2 bag."""
    return (Path(path) / METADATA).is_file()


def read(path: str | Path) -> FlightLog:
    """The flight log of a bag, at 100 Hz. Raises AirTouchError without the extra 'ros' and for a bag without an IMU."""
    need("ros", f"{path}: reading ROS 2 bags")
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    rows: dict[str, list[tuple[float, float]]] = defaultdict(list)
    try:
        with AnyReader([Path(path)], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            for connection, stamp, raw in reader.messages():
                kind = connection.msgtype.rpartition("/")[2]
                if kind in READERS or (kind in ARRAYS and _is_motor(connection.topic)):
                    message = reader.deserialize(raw, connection.msgtype)
                    time = _time(message, stamp)
                    for name, value in (READERS.get(kind) or _motors)(message):
                        rows[name].append((time, value))
    except AirTouchError:
        raise
    except Exception as error:  # a damaged bag makes the library raise any of many
        raise AirTouchError(f"{path}: not a whole ROS 2 bag: {type(error).__name__}: {error}") from None
    signals = {name: tuple(np.array(pairs).T) for name, pairs in rows.items()}
    return aligned_log(signals, {"source": str(path), "format": "rosbag2", "vehicle": "", "acc_frame": "body"})


def _is_motor(topic: str) -> bool:
    return any(word in topic.lower() for word in MOTOR_NAMES)


def _time(message: Any, stamp: int) -> float:
    """Time of a message in s: the header's, or without one that of the recording."""
    header = getattr(message, "header", None)
    stamped = header.stamp.sec + 1e-9 * header.stamp.nanosec if header is not None else 0.0
    return stamped or 1e-9 * stamp


def _xyz(names: tuple[str, ...], vector: Any) -> list[tuple[str, float]]:
    return [(name, float(v)) for name, v in zip(names, (vector.x, vector.y, vector.z), strict=True)]


def _angles(q: Any) -> list[tuple[str, float]]:
    turn = np.array([[q.x, q.y, q.z, q.w]])
    return [(name, float(v[0])) for name, v in zip(ATTITUDE, euler(turn), strict=True)] if turn.any() else []


def _imu(message: Any) -> list[tuple[str, float]]:
    known = message.orientation_covariance[0] != -1.0  # -1: the IMU has no orientation
    return [*_xyz(ACC, message.linear_acceleration), *_xyz(GYRO, message.angular_velocity),
            *(_angles(message.orientation) if known else [])]


def _odometry(message: Any) -> list[tuple[str, float]]:
    pose, twist = message.pose.pose, message.twist.twist.linear  # the twist is in body axes
    q = np.array([pose.orientation.x, pose.orientation.y, pose.orientation.z])
    w, v = float(pose.orientation.w), np.array([twist.x, twist.y, twist.z])
    world = v + 2.0 * np.cross(q, np.cross(q, v) + w * v)
    return [*_xyz(POSITION, pose.position), *zip(VELOCITY, map(float, world), strict=True), *_angles(pose.orientation)]


def _pose(message: Any) -> list[tuple[str, float]]:
    return [*_xyz(POSITION, message.pose.position), *_angles(message.pose.orientation)]


def _motors(message: Any) -> list[tuple[str, float]]:
    values = np.asarray(message.data, float)
    scale = 65535.0 if values.max(initial=0.0) <= 1.0 else 1.0
    return list(zip(PWM, (scale * values).tolist(), strict=True)) if len(values) == 4 else []


READERS = {"Imu": _imu, "Odometry": _odometry, "PoseStamped": _pose, "Range": lambda m: [("zrange_m", float(m.range))],
           "BatteryState": lambda m: [("vbat_V", float(m.voltage))]}
