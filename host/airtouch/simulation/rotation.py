"""Attitudes: unit quaternions, w first, that turn body vectors into world vectors."""

import math

import numpy as np
from airtouch.simulation.compiled import jit


@jit
def rotate(q, x, y, z):
    """The body vector (x, y, z) in world axes."""
    w, a, b, c = q[0], q[1], q[2], q[3]
    tx, ty, tz = 2 * (b * z - c * y), 2 * (c * x - a * z), 2 * (a * y - b * x)
    return (x + w * tx + b * tz - c * ty, y + w * ty + c * tx - a * tz, z + w * tz + a * ty - b * tx)


@jit
def rotate_back(q, x, y, z):
    """The world vector (x, y, z) in body axes."""
    w, a, b, c = q[0], -q[1], -q[2], -q[3]
    tx, ty, tz = 2 * (b * z - c * y), 2 * (c * x - a * z), 2 * (a * y - b * x)
    return (x + w * tx + b * tz - c * ty, y + w * ty + c * tx - a * tz, z + w * tz + a * ty - b * tx)


@jit
def euler(q):
    """Roll, pitch (nose down positive) and yaw in rad: turns about z, then y, then x."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(min(max(2 * (w * y - z * x), -1.0), 1.0))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return roll, pitch, yaw


@jit
def from_euler(roll, pitch, yaw, q):
    """Write the quaternion of roll, pitch and yaw (rad) into q."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    q[0] = cr * cp * cy + sr * sp * sy
    q[1] = sr * cp * cy - cr * sp * sy
    q[2] = cr * sp * cy + sr * cp * sy
    q[3] = cr * cp * sy - sr * sp * cy


@jit
def matrix(q, out, at):
    """Write the 3x3 matrix body to world, row by row, into out[at:at + 9]."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    out[at] = 1 - 2 * (y * y + z * z)
    out[at + 1] = 2 * (x * y - w * z)
    out[at + 2] = 2 * (x * z + w * y)
    out[at + 3] = 2 * (x * y + w * z)
    out[at + 4] = 1 - 2 * (x * x + z * z)
    out[at + 5] = 2 * (y * z - w * x)
    out[at + 6] = 2 * (x * z - w * y)
    out[at + 7] = 2 * (y * z + w * x)
    out[at + 8] = 1 - 2 * (x * x + y * y)


@jit
def normalise(q):
    """Scale q to length one in place."""
    length = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    scale = 1.0 / length
    for i in range(4):
        q[i] *= scale


def as_matrix(roll: np.ndarray, pitch: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Matrices (n, 3, 3) body to world of angles (n,) in rad."""
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)
    rows = [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr]]
    return np.moveaxis(np.array(rows), -1, 0)
