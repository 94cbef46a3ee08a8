"""What effects see at a step, against SciPy's rotations and the platforms' own rectangles."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airtouch.simulation import scenario
from airtouch.simulation import signals as at
from airtouch.simulation.flight import choose
from airtouch.simulation.sensors import log_row
from airtouch.simulation.stepper import Stepper

SCENE = """
name = "over"
[[platform]]
size_m = [0.5, 1.0]
centre_m = [0.65, -0.48]
top_m = 0.7
[[mission.step]]
do = "take-off"
height_m = 0.8
[[mission.step]]
do = "go"
distance_m = 1.5
speed_mps = 0.6
"""


@pytest.fixture(scope="module")
def scene(vehicle):
    """Signals, and state and rotor speeds, at the middle of the last step of each logged row of a flight."""
    plan = scenario.draw_flight(scenario.parse(SCENE, "over"), 1, 0)
    stepper = Stepper(plan, vehicle, 1, 0, choose(plan, {"com_offset": {"x": 0.003, "y": -0.002}}))
    stepper.begin(plan.setpoints[0])
    parts, table = [], np.empty((1, log_row.COLUMNS))
    for row in plan.setpoints[:, None]:
        stepper.fly(row, table)
        forces = stepper.state[0]["forces"]
        parts.append((forces["signals"].copy(), forces["state"].copy(), forces["rotor_speed"].copy()))
    signals, state, speed = (np.array(part) for part in zip(*parts, strict=True))
    return stepper.plant[0], signals, state, speed


def test_velocity_and_rotation_are_the_bodys(scene):
    """To 2e-6: the quaternion half a step on is not of unit length."""
    _, signals, state, _ = scene
    turn = Rotation.from_quat(np.roll(state[:, 6:10], -1, axis=1))
    np.testing.assert_allclose(signals[:, at.ROTATION:at.ROTATION + 9], turn.as_matrix().reshape(-1, 9), atol=2e-6)
    np.testing.assert_allclose(signals[:, at.VELOCITY:at.VELOCITY + 3], turn.inv().apply(state[:, 3:6]), atol=2e-6)
    np.testing.assert_array_equal(signals[:, at.POSITION:at.POSITION + 3], state[:, :3])


def test_thrust_is_the_square_of_the_speed(scene):
    plant, signals, _, speed = scene
    np.testing.assert_allclose(signals[:, at.THRUST:at.THRUST + 4],
                               plant["thrust_per_speed2"] * speed**2 * plant["gain"], rtol=0.1)
    np.testing.assert_array_equal(signals[:, at.ROTOR_SPEED:at.ROTOR_SPEED + 4], speed)


def test_each_rotor_is_over_the_surface_below_its_own_disc(scene):
    """Discs are placed by SciPy; what is below each follows from the platform's rectangle alone."""
    plant, signals, state, _ = scene
    turn = Rotation.from_quat(np.roll(state[:, 6:10], -1, axis=1))
    radius, kinds = plant["rotor_radius"], np.zeros(3, int)
    for i in range(4):
        arm = [plant["rotor_x"][i] - plant["com"][0], plant["rotor_y"][i] - plant["com"][1], 0.0]
        disc = state[:, :3] + turn.apply(arm)
        inside = np.stack([disc[:, 0] - 0.4, 0.9 - disc[:, 0], disc[:, 1] + 0.98, 0.02 - disc[:, 1]])  # m, of each edge
        high = disc[:, 2] > 0.71
        over = (inside > radius).all(axis=0) & high
        off = (inside < -radius).any(axis=0)
        passing = ((np.abs(inside) < radius).sum(axis=0) == 1) & ((inside > radius).sum(axis=0) == 3) & high
        lower, upper = signals[:, at.LOWER_HEIGHT + i], signals[:, at.UPPER_HEIGHT + i]
        cover = signals[:, at.COVER + i]
        rows_expected = np.where(cover > 0.5, upper, lower)
        np.testing.assert_allclose(rows_expected[over], disc[over, 2] - 0.7, atol=2e-6)
        np.testing.assert_allclose(rows_expected[off], disc[off, 2], atol=2e-6)
        np.testing.assert_allclose(lower[passing], disc[passing, 2], atol=2e-6)
        np.testing.assert_allclose(upper[passing], disc[passing, 2] - 0.7, atol=2e-6)
        share = inside[:, passing].min(axis=0) / radius  # a chord that far from the centre cuts off this share
        covered = 1 - (np.arccos(share) - share * np.sqrt(1 - share**2)) / np.pi
        np.testing.assert_allclose(cover[passing], covered, atol=0.03)
        kinds += [over.sum(), off.sum(), passing.sum()]
    assert (kinds > 20).all(), kinds
