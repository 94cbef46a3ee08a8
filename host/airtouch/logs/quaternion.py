"""Attitude: quaternions (x, y, z, w), Bitcraze's 32-bit form, Euler angles, rotations.

R = Rz(yaw) Ry(pitch) Rx(roll) takes body vectors (x forward, y left, z up) to the world.
"""

import numpy as np


def decompress(compressed: np.ndarray) -> np.ndarray:
    """Quaternions x, y, z, w, (n, 4), from Bitcraze's compressed form (`stateEstimateZ.quat`), (n,).

    The two top bits are the index of the largest component, which is positive. For each other
    component follow, in order, a sign bit and nine bits of magnitude times sqrt(2).
    Values that are no unsigned 32-bit integer give NaN.
    Source: the description in crazyflie-firmware, src/utils/interface/quatcompress.h.
    """
    compressed = np.asarray(compressed, dtype=np.float64)
    valid = (compressed >= 0) & (compressed < 2.0**32) & (compressed == np.floor(compressed))
    word = np.where(valid, compressed, 0).astype(np.uint64)
    largest = (word >> np.uint64(30)).astype(np.intp)
    fields = np.stack([(word >> np.uint64(shift)) & np.uint64(0x3FF) for shift in (20, 10, 0)], axis=1)
    magnitude = (fields & np.uint64(0x1FF)).astype(np.float64) / (511.0 * np.sqrt(2.0))
    smaller = np.where(fields & np.uint64(0x200), -magnitude, magnitude)
    q = np.empty((len(word), 4))
    rest = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[largest]
    np.put_along_axis(q, rest, smaller, axis=1)
    root = np.sqrt(np.maximum(1.0 - (smaller**2).sum(axis=1), 0.0))
    np.put_along_axis(q, largest[:, None], root[:, None], axis=1)
    q[~valid] = np.nan
    return q


def euler(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll, pitch and yaw, each (n,) rad, of quaternions (n, 4) of any length; NaN where not finite."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        x, y, z, w = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
        roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
        yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return roll, pitch, yaw


def rotation(roll: np.ndarray, pitch: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Rotation matrices from body to world, (n, 3, 3), of angles (n,) in rad."""
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (np.cos, np.sin))
    return np.stack([
        np.stack([cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], axis=-1),
        np.stack([sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], axis=-1),
        np.stack([-sp, cp * sr, cp * cr], axis=-1),
    ], axis=-2)


def to_body(world: np.ndarray, roll: np.ndarray, pitch: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """World vectors (n, 3) in body axes, (n, 3); angles (n,) in rad."""
    return np.einsum("nji,nj->ni", rotation(roll, pitch, yaw), world)
