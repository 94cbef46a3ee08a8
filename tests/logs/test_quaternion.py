"""The attitude code against SciPy's rotations and an encoder written from the format."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from airtouch.logs.quaternion import decompress, euler, rotation, to_body


def compress(q):
    """A unit quaternion (x, y, z, w) as Bitcraze's 32 bits."""
    largest = int(np.argmax(np.abs(q)))
    q = q * np.sign(q[largest])
    word = largest
    for i in range(4):
        if i != largest:
            word = word << 10 | (int(q[i] < 0) << 9) | round(min(abs(q[i]) * np.sqrt(2), 1) * 511)
    return word


def test_decompress_inverts_the_format():
    rotations = Rotation.random(2000, random_state=1)
    q = decompress(np.array([compress(quaternion) for quaternion in rotations.as_quat()], dtype=float))
    error = (Rotation.from_quat(q) * rotations.inv()).magnitude()
    assert error.max() < 0.005  # nine bits: half a step of 1/723 in three components, doubled
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1)


@given(st.lists(st.floats(allow_nan=True), min_size=1, max_size=20))
def test_what_is_no_32_bit_number_decompresses_to_nan(values):
    q = decompress(np.array(values))
    valid = [0 <= v < 2**32 and v == int(v) for v in np.nan_to_num(values, nan=-1, posinf=-1, neginf=-1)]
    assert np.isfinite(q).all(axis=1).tolist() == valid


def test_euler_and_rotation_are_scipys():
    rotations = Rotation.random(500, random_state=2)
    angles = euler(rotations.as_quat())
    yaw, pitch, roll = rotations.as_euler("ZYX").T
    np.testing.assert_allclose(angles, (roll, pitch, yaw), atol=1e-9)
    np.testing.assert_allclose(rotation(*angles), rotations.as_matrix(), atol=1e-9)
    world = np.random.default_rng(3).normal(size=(500, 3))
    np.testing.assert_allclose(to_body(world, *angles), rotations.apply(world, inverse=True), atol=1e-9)
