"""The renderer against closed forms: projection, blur, photon noise."""

import math

import numpy as np
import pytest

from airtouch.vision.camera import Camera, blur_px, electron_rate, expose, exposure_s
from skips import needs

pytestmark = needs("cv2")
CAMERA = Camera()
LEVEL = np.eye(3)
HALF_PLANE = np.array([[0.0, -3.0], [3.0, -3.0], [3.0, 3.0], [0.0, 3.0]])  # a platform from x = 0 on


def scenes():
    from airtouch.vision import scene

    return scene


def plain_scene(floor, top, corners=HALF_PLANE, height=0.76):
    flat = np.ones((scenes().TILE_PX, scenes().TILE_PX), np.float32)
    return scenes().Scene(floor * flat, top * flat, corners, height)


def about_y(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def test_a_point_ahead_lies_at_f_x_over_h():
    pose = scenes().Pose(np.array([1.0, 2.0, 0.80]), LEVEL)
    pixel = scenes().project(CAMERA, pose, np.array([[1.02, 2.0, 0.76], [1.0, 2.01, 0.76]]))
    ahead = 180.0 * 0.02 / 0.04
    assert pixel[0] == pytest.approx([161.5 + ahead, 121.5])
    assert pixel[1] == pytest.approx([161.5, 121.5 - 180.0 * 0.01 / 0.04])  # left is up


def test_rays_meet_the_ground_where_points_are_projected_from():
    pose = scenes().Pose(np.array([0.3, -0.2, 0.9]), about_y(0.2))
    x, y = scenes().ground_points(CAMERA, pose, 0.1)
    for row, column in ((0, 0), (100, 50), (243, 323)):
        place = np.array([[x[row, column], y[row, column], 0.1]])
        assert scenes().project(CAMERA, pose, place)[0] == pytest.approx([column, row], abs=1e-3)


def test_a_drone_that_pitches_down_looks_behind_itself():
    """Nose down by a: the middle ray meets the floor h tan(a) behind."""
    pose = scenes().Pose(np.array([0.0, 0.0, 1.0]), about_y(0.1))
    x, _ = scenes().ground_points(CAMERA, pose, 0.0)
    assert 0.5 * (x[121, 161] + x[121, 162]) == pytest.approx(-math.tan(0.1), rel=1e-3)


@pytest.mark.parametrize("place", [-0.02, 0.0, 0.015])
def test_the_rim_is_rendered_where_it_projects_to(place):
    pose = scenes().Pose(np.array([place, 0.0, 0.80]), LEVEL)
    row = scenes().view(CAMERA, pose, plain_scene(0.2, 0.8))[120]
    assert np.argmax(row > 0.5) == math.ceil(161.5 - 180.0 * place / 0.04)


def test_a_ray_beside_the_platform_meets_the_floor_and_one_at_the_sky_nothing():
    pose = scenes().Pose(np.array([-1.0, 0.0, 0.80]), about_y(-1.2))
    image = scenes().view(CAMERA, pose, plain_scene(0.2, 0.8))
    assert np.isfinite(image).all()
    assert scenes().view(CAMERA, scenes().Pose(np.array([-1.0, 0.0, 0.8]), LEVEL),
                         plain_scene(0.2, 0.8)) == pytest.approx(0.2)


def test_blur_is_as_long_as_speed_times_exposure_times_focal_length_over_height():
    speed, seconds, height = 0.3, 0.02, 0.04
    places = [np.array([speed * seconds * s, 0.0, 0.76 + height]) for s in np.linspace(-0.5, 0.5, 41)]
    row = scenes().blur(CAMERA, [scenes().Pose(p, LEVEL) for p in places], plain_scene(0.0, 1.0))[120]
    ramp = np.count_nonzero((row > 0.01) & (row < 0.99))
    assert blur_px(CAMERA, speed, seconds, height) == pytest.approx(27.0)
    assert ramp == pytest.approx(27.0, abs=1.5)


def test_noise_has_the_variance_of_photons_and_reading():
    lux, albedo = 20.0, 0.5
    seconds = exposure_s(CAMERA, lux, albedo)
    electrons = 20.0 * 0.5 / (4 * 2.8**2) * 1.1e16 * 3.6e-6**2 * 0.4 * seconds
    image = expose(CAMERA, np.full((400, 400), albedo), lux, seconds, np.random.default_rng(1)).astype(float)
    grey = 255.0 * CAMERA.target / electrons  # per electron
    assert image.mean() == pytest.approx(255.0 * CAMERA.target, rel=0.01)
    assert image.var() == pytest.approx(grey**2 * (electrons + 64.0) + 1 / 12, rel=0.03)


def test_exposure_grows_as_light_falls_until_it_may_not():
    bright, dim, dark = (exposure_s(CAMERA, lux, 0.5) for lux in (500.0, 250.0, 1.0))
    assert dim == pytest.approx(2 * bright) and dark == pytest.approx(1 / 30)
    assert electron_rate(CAMERA, 500.0, 0.5) * bright == pytest.approx(0.3 * 5000.0)


def test_a_texture_repeats_has_its_mean_and_contrast():
    tile = scenes().texture(np.random.default_rng(2), 0.5, 0.1)
    assert tile.mean() == pytest.approx(0.5, abs=1e-3) and tile.std() == pytest.approx(0.05, rel=0.02)
    seam, inside = np.abs(tile[:, 0] - tile[:, -1]).mean(), np.abs(np.diff(tile, axis=1)).mean()
    assert seam < 2 * inside
