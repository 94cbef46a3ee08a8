"""ROS 2 bags (a folder with `metadata.yaml`, sqlite3 or mcap), read by `rosbags` (extra 'ros').

Messages are recognised by their type, not by the name of the topic. Axes are those of REP 103 (x forward, y left,
z up), as in a FlightLog. Motors are an array of four numbers on a topic with "motor", "pwm" or "actuator" in its name.
Each column comes from one topic.
"""

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError, printable
from airtouch.extras import need
from airtouch.logs.alignment import aligned_log
from airtouch.logs.flight_log import ACC, ATTITUDE, GYRO, POSITION, PWM, VELOCITY, FlightLog
from airtouch.logs.quaternion import euler

METADATA = "metadata.yaml"
STAMPED, RECORDED = 0, 1  #: rows of a table with the headers' times and those of the recording, s
LATE_S = 1.0  #: s, longest difference that the way to the recorder makes; chosen
MOTOR_NAMES = ("motor", "pwm", "actuator")
ARRAYS = ("UInt16MultiArray", "UInt32MultiArray", "Int32MultiArray", "Float32MultiArray", "Float64MultiArray")
DOWN_NAMES = ("down", "bottom", "zrange")  #: in the topic or the frame id of the range sensor that looks down
MOST_SHARE = 2.0  #: largest value of motor commands from 0 to 1, which may overshoot; chosen
PULSE_US = (800.0, 2200.0)  #: us, shortest and longest pulse of motors that take 1000 to 2000 us; chosen


def is_bag(path: str | Path) -> bool:
    """True if the path is the folder of a ROS 2 bag."""
    return (Path(path) / METADATA).is_file()


def read(path: str | Path) -> FlightLog:
    """The flight log of a bag, at 100 Hz, by the times in the headers, or by those of the recording (`_two_clocks`).

    Raises AirTouchError without the extra 'ros' and for a bag without an IMU.
    """
    need("ros", f"{path}: reading ROS 2 bags")
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    rows: dict[str, dict[str, list[tuple[float, float, float]]]] = defaultdict(lambda: defaultdict(list))
    kinds: dict[str, str] = {}  # of each topic, in the order of their first messages
    frames: dict[str, str] = {}
    try:
        with AnyReader([Path(path)], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            for connection, stamp, raw in reader.messages():
                topic, kind = connection.topic, connection.msgtype.rpartition("/")[2]
                if kind in READERS or (kind in ARRAYS and _is_motor(topic)):
                    message = reader.deserialize(raw, connection.msgtype)
                    recorded_s = 1e-9 * stamp
                    stamped_s = _header_s(message) or recorded_s
                    kinds.setdefault(topic, kind)
                    frames.setdefault(topic, str(getattr(getattr(message, "header", None), "frame_id", "")))
                    for name, value in (READERS.get(kind) or _motors)(message):
                        rows[name][topic].append((stamped_s, recorded_s, value))
    except AirTouchError:
        raise
    except Exception as error:  # a damaged bag makes the library raise any of many
        raise AirTouchError(f"{path}: not a whole ROS 2 bag: {type(error).__name__}: {error}") from None
    chosen = {name: min(topics, key=lambda topic: _rank(topic, kinds, frames)) for name, topics in rows.items()}
    table = {name: np.array(rows[name][topic]).T for name, topic in chosen.items()}
    clock = RECORDED if _two_clocks(table) else STAMPED
    signals = {name: (values[clock], values[2]) for name, values in table.items()}
    warnings = _ignored(rows, chosen)
    if PWM[0] in signals:
        pwm, unit = _pwm(np.array([signals[name][1] for name in PWM]), kinds[chosen[PWM[0]]])
        warnings.append(f"{printable(chosen[PWM[0]])}: motor commands taken as {unit}, by their range")
        signals |= {name: (signals[name][0], values) for name, values in zip(PWM, pwm, strict=True)}
    return aligned_log(signals, {"source": str(path), "format": "rosbag2", "vehicle": "", "acc_frame": "body",
                                 "warnings": warnings})


def _rank(topic: str, kinds: dict[str, str], frames: dict[str, str]) -> tuple[int, bool, int]:
    """Place of a topic among those of a column: by type, then range sensors that look down, then the first."""
    kind = kinds[topic]
    down = any(word in name.lower() for name in (topic, frames[topic]) for word in DOWN_NAMES)
    by_type = list(READERS).index(kind) if kind in READERS else len(READERS)
    return by_type, kind == "Range" and not down, list(kinds).index(topic)


def _ignored(rows: dict[str, dict[str, Any]], chosen: dict[str, str]) -> list[str]:
    """A warning for each topic that has values of a column which comes from another one."""
    columns: dict[tuple[str, str], list[str]] = defaultdict(list)
    for name, topic in chosen.items():
        for other in rows[name]:
            if other != topic:
                columns[other, topic].append(name)
    return [f"{printable(other)} is left out of {', '.join(names)}: read from {printable(topic)}"
            for (other, topic), names in columns.items()]


def _is_motor(topic: str) -> bool:
    return any(word in topic.lower() for word in MOTOR_NAMES)


def _header_s(message: Any) -> float:
    """Time in a message's header in s; 0 without one."""
    header = getattr(message, "header", None)
    return header.stamp.sec + 1e-9 * header.stamp.nanosec if header is not None else 0.0


def _two_clocks(table: dict[str, np.ndarray]) -> bool:
    """True if headers and recording differ by more in one message than in another by over the recording's length.

    The times of the columns then do not overlap: with use_sim_time headers have simulated time, and messages without
    one that of the recording.
    """
    if not table:
        return False
    recorded = np.concatenate([values[RECORDED] for values in table.values()])
    ahead = np.concatenate([values[RECORDED] - values[STAMPED] for values in table.values()])
    return bool(np.ptp(ahead) > np.ptp(recorded) + LATE_S)


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


def _range(message: Any) -> list[tuple[str, float]]:
    """The down range; NaN outside of the message's limits, where they are set."""
    outside = message.max_range > message.min_range and not message.min_range <= message.range <= message.max_range
    return [("zrange_m", np.nan if outside else float(message.range))]


def _motors(message: Any) -> list[tuple[str, float]]:
    values = np.asarray(message.data, float)
    return list(zip(PWM, values.tolist(), strict=True)) if len(values) == 4 else []


def _pwm(commands: np.ndarray, kind: str) -> tuple[np.ndarray, str]:
    """PWM (4, n) of a topic's motor commands (4, n), and their unit in words, by their type and range."""
    there = commands[np.isfinite(commands) & (commands != 0.0)]
    most = there.max(initial=0.0)
    if kind.startswith("Float") and most <= MOST_SHARE:
        return 65535.0 * np.clip(commands, 0.0, 1.0), "0 to 1"
    if len(there) and there.min() >= PULSE_US[0] and most <= PULSE_US[1]:
        return 65535.0 * np.clip((commands - 1000.0) / 1000.0, 0.0, 1.0), "pulses of 1000 to 2000 us"
    return commands, "PWM of 0 to 65535"


#: message type -> reader of its columns; of two types with the same column the one that comes first is read
READERS = {"Odometry": _odometry, "PoseStamped": _pose, "Imu": _imu, "Range": _range,
           "BatteryState": lambda m: [("vbat_V", float(m.voltage))]}
