"""Attitude, floor and gaps of logs that do not hold them, against motions whose truth is given."""

import numpy as np
import pytest

from airtouch.gap.flights.motion import GRAVITY, MARKER_M, attitude, interpolate_missing, rotor_heights, standing_z
from airtouch.logs.flight_log import FlightLog

PERIOD_S = 0.01


def log_of(**columns):
    n = len(next(iter(columns.values())))
    return FlightLog({"t_s": np.arange(n) * PERIOD_S, **columns}, {})


def test_holes_are_filled_by_straight_lines():
    table = np.array([[np.nan, 1.0], [1.0, np.nan], [np.nan, 3.0], [3.0, np.inf]])
    np.testing.assert_allclose(interpolate_missing(table), [[1.0, 1.0], [1.0, 2.0], [2.0, 3.0], [3.0, 3.0]])
    np.testing.assert_allclose(interpolate_missing(np.array([np.nan, 2.0, np.nan, 4.0])), [2.0, 2.0, 3.0, 4.0])
    assert (interpolate_missing(np.full((3, 2), np.nan)) == 0.0).all()
    original = np.array([1.0, np.nan])
    interpolate_missing(original)
    assert np.isnan(original[1]), "the log itself stays as it is"


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.0])
def test_tilt_is_that_of_what_pushes_over_ground(yaw):
    """Tilted by roll and pitch under a thrust along its own z axis: world force by rotation."""
    from scipy.spatial.transform import Rotation
    roll, pitch, n = 0.1, -0.15, 300
    turn = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    force = turn.apply([0.0, 0.0, 10.0])
    columns = {f"acc_world_{a}_mps2": np.full(n, force[i]) for i, a in enumerate("xyz")}
    angles = attitude(log_of(**columns, yaw_rad=np.full(n, yaw)), PERIOD_S)
    # roll is told over the horizontal push, not within the pitched plane: 2 % off at these angles
    np.testing.assert_allclose(angles, np.tile([roll, pitch, yaw], (n, 1)), atol=0.004)


def test_logged_angles_are_taken_as_they_are_and_yaw_is_the_gyros_where_none_is():
    n = 400
    turning = {f"gyro_{a}_radps": np.full(n, w) for a, w in zip("xyz", (0.0, 0.0, 0.5), strict=True)}
    angles = attitude(log_of(**turning, roll_rad=np.linspace(0.0, 0.3, n)), PERIOD_S)
    np.testing.assert_allclose(angles[:, 0], np.linspace(0.0, 0.3, n))
    np.testing.assert_allclose(angles[:, 2], 0.5 * PERIOD_S * np.arange(n), atol=1e-12)


def test_fast_tilts_come_from_the_gyro():
    n = 2000
    t = np.arange(n) * PERIOD_S
    rate = 0.3 * 2.0 * np.pi * 3.0 * np.cos(2.0 * np.pi * 3.0 * t)
    still = {f"acc_world_{a}_mps2": np.full(n, GRAVITY * (a == "z")) for a in "xyz"}
    angles = attitude(log_of(**still, gyro_x_radps=rate, gyro_y_radps=np.zeros(n), gyro_z_radps=np.zeros(n)), PERIOD_S)
    np.testing.assert_allclose(angles[300:-300, 0], 0.3 * np.sin(2.0 * np.pi * 3.0 * t)[300:-300], atol=0.04)


def test_the_edge_passes_under_each_rotor_when_it_is_there():
    """At 0.5 m/s over a step of the floor: a rotor 5 cm ahead meets it 0.1 s earlier than the range sensor."""
    n, edge = 400, 200
    log = log_of(zrange_m=np.where(np.arange(n) < edge, 0.8, 0.3), z_m=np.full(n, 0.8), vx_mps=np.full(n, 0.5),
                 vy_mps=np.zeros(n))
    turn = np.tile(np.eye(3), (n, 1, 1))
    x, y = np.array([0.05, -0.05, -0.05, 0.05]), np.array([-0.05, -0.05, 0.05, 0.05])
    height = rotor_heights(log, turn, x, y, 0.02, 0.04, np.zeros(n, bool), PERIOD_S)
    low = height - (0.8 - 0.02) < -0.24
    first = np.argmax(low[50:], axis=0) + 50
    np.testing.assert_allclose(first, edge - np.round(x / 0.5 / PERIOD_S), atol=1)


def test_without_a_range_the_floor_is_flat_and_standing_is_known():
    n = 50
    z = np.r_[np.full(10, 0.03), np.full(40, 0.5)]
    ground = np.arange(n) < 10
    turn = np.tile(np.eye(3), (n, 1, 1))
    height = rotor_heights(log_of(z_m=z), turn, np.zeros(4), np.zeros(4), 0.02, 0.04, ground, PERIOD_S)
    np.testing.assert_allclose(height[20], 0.51)
    assert rotor_heights(log_of(x_m=z), turn, np.zeros(4), np.zeros(4), 0.0, 0.0, ground, PERIOD_S) is None
    assert standing_z(z, ground) == 0.03 and standing_z(z + 1.0, np.zeros(n, bool)) == MARKER_M
    assert standing_z(z - 0.02, np.zeros(n, bool)) == pytest.approx(0.01)
