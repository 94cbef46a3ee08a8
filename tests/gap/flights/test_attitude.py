"""Attitude and holes of logs that do not hold them, against motions whose truth is given."""

import numpy as np
import pytest

from airtouch.gap.flights.attitude import GRAVITY, attitude
from airtouch.gap.flights.clock import PERIOD_S
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.logs.flight_log import FlightLog


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
    angles = attitude(log_of(**columns, yaw_rad=np.full(n, yaw)))
    # roll is told over the horizontal push, not within the pitched plane: 2 % off at these angles
    np.testing.assert_allclose(angles, np.tile([roll, pitch, yaw], (n, 1)), atol=0.004)


def test_logged_angles_are_taken_as_they_are_and_yaw_is_the_gyros_where_none_is():
    n = 400
    turning = {f"gyro_{a}_radps": np.full(n, w) for a, w in zip("xyz", (0.0, 0.0, 0.5), strict=True)}
    angles = attitude(log_of(**turning, roll_rad=np.linspace(0.0, 0.3, n)))
    np.testing.assert_allclose(angles[:, 0], np.linspace(0.0, 0.3, n))
    np.testing.assert_allclose(angles[:, 2], 0.5 * PERIOD_S * np.arange(n), atol=1e-12)


def test_fast_tilts_come_from_the_gyro():
    n = 2000
    t = np.arange(n) * PERIOD_S
    rate = 0.3 * 2.0 * np.pi * 3.0 * np.cos(2.0 * np.pi * 3.0 * t)
    still = {f"acc_world_{a}_mps2": np.full(n, GRAVITY * (a == "z")) for a in "xyz"}
    angles = attitude(log_of(**still, gyro_x_radps=rate, gyro_y_radps=np.zeros(n), gyro_z_radps=np.zeros(n)))
    np.testing.assert_allclose(angles[300:-300, 0], 0.3 * np.sin(2.0 * np.pi * 3.0 * t)[300:-300], atol=0.04)


def test_the_tilt_is_told_in_the_heading_that_the_gyro_gives():
    """Turned by 90 degrees without a logged yaw: a push along the world's y axis is one along the body's x axis."""
    n = 800
    turn = np.where((np.arange(n) - 0.5) % n < 100, 0.5 * np.pi / (100 * PERIOD_S), 0.0)
    force = {"acc_world_x_mps2": np.zeros(n), "acc_world_y_mps2": np.full(n, 1.0), "acc_world_z_mps2": np.full(n, 9.81)}
    angles = attitude(log_of(**force, gyro_x_radps=np.zeros(n), gyro_y_radps=np.zeros(n), gyro_z_radps=turn))
    np.testing.assert_allclose(angles[400:-200], [[0.0, np.arctan(1.0 / 9.81), 0.5 * np.pi]] * (n - 600), atol=0.01)


@pytest.mark.parametrize("gravity", [0.0, GRAVITY])
def test_world_axes_with_and_without_gravity_give_the_same_tilt(gravity):
    n = 800
    force = {f"acc_{a}_mps2": np.full(n, v) for a, v in zip("xyz", (1.0, 0.0, gravity), strict=True)}
    log = FlightLog(log_of(**force, **{f"gyro_{a}_radps": np.zeros(n) for a in "xyz"}).columns, {"acc_frame": "world"})
    np.testing.assert_allclose(attitude(log)[200:-200, 1], np.arctan(1.0 / GRAVITY), rtol=0.01)


def test_a_hole_in_a_heading_that_passes_half_a_turn_is_bridged_the_short_way():
    yaw = np.linspace(np.pi - 0.2, np.pi + 0.2, 41)
    logged = np.angle(np.exp(1j * yaw))
    logged[18:23] = np.nan
    np.testing.assert_allclose(attitude(log_of(yaw_rad=logged))[:, 2], yaw, atol=1e-12)
