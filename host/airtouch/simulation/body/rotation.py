"""Attitudes: unit quaternions, w first, that turn body vectors into world vectors."""

import math

import numpy as np

from airtouch.simulation.compiled import jit


@jit
def rotate(q, x, y, z):
    """The body vector (x, y, z) in world axes, a tuple; q (4,)."""
    w, a, b, c = q[0], q[1], q[2], q[3]
    tx, ty, tz = 2 * (b * z - c * y), 2 * (c * x - a * z), 2 * (a * y - b * x)
    return (x + w * tx + b * tz - c * ty, y + w * ty + c * tx - a * tz, z + w * tz + a * ty - b * tx)


@jit
def rotate_back(q, x, y, z):
    """The world vector (x, y, z) in body axes, a tuple; q (4,)."""
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
    """Write the quaternion of roll, pitch and yaw (rad) into q (4,)."""
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


@jit
def sine_and_cosine(x):
    """sin(x) and cos(x) of an angle of up to some hundred turns, to 1e-13: a third of the time of two calls.

    Source: the polynomials of Sun's fdlibm (k_sin.c, k_cos.c), on the nearest quarter of a turn.
    """
    quarter = math.floor(x * 0.6366197723675814 + 0.5)
    r = (x - quarter * 1.5707963267341256) - quarter * 6.077100506506192e-11
    z = r * r
    sine = r + r * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * (
        -1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 + z * (
            -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))))
    cosine = 1.0 - 0.5 * z + z * z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * (
        2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 + z * (
            2.08757232129817482790e-09 - z * 1.13596475577881948265e-11)))))
    turn = int(quarter) & 3
    if turn & 1:
        sine, cosine = cosine, -sine
    return (-sine, -cosine) if turn & 2 else (sine, cosine)


def as_matrix(roll: np.ndarray, pitch: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Matrices (n, 3, 3) body to world of angles (n,) in rad."""
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)
    rows = [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr]]
    return np.moveaxis(np.array(rows), -1, 0)
