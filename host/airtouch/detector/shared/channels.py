"""The nine channels of the paper (section 4.2) out of a flight log."""

from collections.abc import Collection

import numpy as np

from airtouch.logs.flight_log import ACC, ACC_WORLD, ATTITUDE, GYRO, PWM, FlightLog

ACCELERATIONS, RATES, DIFFERENCES = ("ax", "ay", "az"), ("gyro x", "gyro y", "gyro z"), ("m2-m1", "m3-m1", "m4-m1")
#: Names of the columns of `nine_channels`.
PAPER_CHANNELS = (*ACCELERATIONS, *RATES, *DIFFERENCES)


def nine_channels(log: FlightLog) -> np.ndarray:
    """(n, 9) float32: accelerations, angular rates, motor differences.

    Accelerations are m/s^2 in level axes with gravity in z, angular rates rad/s
    about body axes, motor differences PWM (0..65535) against motor 1.
    Raises AirTouchError that names the columns which the log lacks.
    """
    return logged_channels(log, ())[1]


def logged_channels(log: FlightLog, missing: Collection[str]) -> tuple[list[str], np.ndarray]:
    """Names (k) and values (n, k) float32 of those of the nine channels whose sensor is not missing.

    missing: of "acceleration", "rates", "motors" (`sensors.missing_sensors`). Raises AirTouchError that names the
    columns which the log lacks of the others.
    """
    names: list[str] = []
    parts = [np.empty((len(log), 0))]
    if "acceleration" not in missing:
        names += ACCELERATIONS
        parts.append(level_acceleration(log))
    if "rates" not in missing:
        names += RATES
        parts.append(log.stack(GYRO))
    if "motors" not in missing:
        pwm = log.stack(PWM)
        names += DIFFERENCES
        parts.append(pwm[:, 1:] - pwm[:, :1])
    return names, np.hstack(parts).astype(np.float32)


def level_acceleration(log: FlightLog) -> np.ndarray:
    """(n, 3) specific force, m/s^2, +g in z at rest: world axes where logged.

    Else body accelerations turned level by roll and pitch where those are logged,
    else body accelerations as they are. Raises AirTouchError without any.
    """
    if log.has(*ACC_WORLD):
        return log.stack(ACC_WORLD)
    body = log.stack(ACC)
    if not log.has(*ATTITUDE[:2]):
        return body
    roll, pitch = log["roll_rad"], log["pitch_rad"]
    y = np.cos(roll) * body[:, 1] - np.sin(roll) * body[:, 2]
    z = np.sin(roll) * body[:, 1] + np.cos(roll) * body[:, 2]
    x = np.cos(pitch) * body[:, 0] + np.sin(pitch) * z
    return np.column_stack([x, y, np.cos(pitch) * z - np.sin(pitch) * body[:, 0]])


def thrust_axis(log: FlightLog) -> np.ndarray | None:
    """(n, 3) direction of thrust R e_z in the axes of `level_acceleration`, None where unknown.

    NaN angles count as level.
    """
    if not log.has(*ATTITUDE[:2]):
        return None
    roll, pitch = np.nan_to_num(log["roll_rad"]), np.nan_to_num(log["pitch_rad"])
    turned = log.has(*ACC_WORLD) and log.has("yaw_rad")
    yaw = np.nan_to_num(log["yaw_rad"]) if turned else np.zeros(len(log))
    forward = np.sin(pitch) * np.cos(roll)
    return np.column_stack([
        np.cos(yaw) * forward + np.sin(yaw) * np.sin(roll),
        np.sin(yaw) * forward - np.cos(yaw) * np.sin(roll),
        np.cos(pitch) * np.cos(roll),
    ])
