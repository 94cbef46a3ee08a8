"""A floor and a raised platform with textures, rendered through a moving camera.

Each pixel's ray meets the platform's top, or the floor beside it. The platform is a thin board: its sides, the drone's
own shadow, gloss and the lens's distortion are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from airtouch.simulation.flight_plan.world import inside
from airtouch.vision.camera import Camera, blur_px

TILE_PX = 512  #: pixels of a texture, repeated over the plane
BLUR_STEP_PX = 5.0  #: pixels of motion blur between two rendered poses of an exposure
FLOOR_M_PER_PX, TOP_M_PER_PX = 2.0e-3, 2.5e-4  #: of the textures, finer than a pixel sees


@dataclass(frozen=True)
class Scene:
    """floor, top: textures, albedo (TILE_PX, TILE_PX) float32, repeated. corners_m: (k, 2) of the platform, convex,
    anticlockwise. top_m: its height."""

    floor: np.ndarray
    top: np.ndarray
    corners_m: np.ndarray
    top_m: float


@dataclass(frozen=True)
class Pose:
    """Where the camera is, (3,) m, and its attitude, (3, 3) body to world."""

    place_m: np.ndarray
    attitude: np.ndarray


def texture(rng: np.random.Generator, albedo: float, contrast: float, slope: float = 1.0) -> np.ndarray:
    """A tile of 1/f^slope noise around a mean albedo; contrast: its rms over the mean. Repeats without a seam."""
    across = np.fft.fftfreq(TILE_PX)[:, None] ** 2 + np.fft.rfftfreq(TILE_PX)[None, :] ** 2
    across[0, 0] = np.inf
    spectrum = np.fft.rfft2(rng.normal(size=(TILE_PX, TILE_PX))) * across ** (-slope / 2.0)
    noise = np.fft.irfft2(spectrum, s=(TILE_PX, TILE_PX))
    return np.clip(albedo * (1.0 + contrast * noise / noise.std()), 0.02, 0.98).astype(np.float32)


def ground_points(camera: Camera, pose: Pose, height_m: float) -> tuple[np.ndarray, np.ndarray]:
    """x and y (rows, columns), float32, m, at which the pixels' rays meet the plane z = height_m, or NaN."""
    rays = _rays(camera) @ pose.attitude.T.astype(np.float32)  # (rows, columns, 3)
    down = rays[..., 2]
    along = np.full(down.shape, np.nan, np.float32)
    np.divide(height_m - pose.place_m[2], down, out=along, where=down * (height_m - pose.place_m[2]) > 0.0)
    return pose.place_m[0] + along * rays[..., 0], pose.place_m[1] + along * rays[..., 1]


@cache
def _rays(camera: Camera) -> np.ndarray:
    """(rows, columns, 3) float32: the pixels' directions in the body, x forward, y left, z up; z is -focal_px."""
    u, v = np.meshgrid(np.arange(camera.width) - camera.centre[0], np.arange(camera.height) - camera.centre[1])
    return np.stack([u, -v, np.full(u.shape, -camera.focal_px)], axis=-1).astype(np.float32)


def project(camera: Camera, pose: Pose, points_m: np.ndarray) -> np.ndarray:
    """(n, 2) pixels (x, y) of points (n, 3) in front of the camera."""
    in_camera = (points_m - pose.place_m) @ pose.attitude
    return np.column_stack([camera.centre[0] - camera.focal_px * in_camera[:, 0] / in_camera[:, 2],
                            camera.centre[1] + camera.focal_px * in_camera[:, 1] / in_camera[:, 2]])


def view(camera: Camera, pose: Pose, scene: Scene) -> np.ndarray:
    """Albedo (rows, columns), float32, that a camera at rest sees."""
    on_top = np.zeros((camera.height, camera.width), bool)
    if pose.place_m[2] > scene.top_m:
        x, y = ground_points(camera, pose, scene.top_m)
        on_top = inside(scene.corners_m, x, y)
        if on_top.any():
            top = _sample(scene.top, x, y, TOP_M_PER_PX)
    if on_top.all():
        return top
    floor = _sample(scene.floor, *ground_points(camera, pose, 0.0), FLOOR_M_PER_PX)
    return np.where(on_top, top, floor) if on_top.any() else floor


def subposes(camera: Camera, speed_mps: float, seconds: float, distance_m: float) -> np.ndarray:
    """Shares of an exposure, -0.5 to 0.5, at which to render: 3 to 13, in steps of BLUR_STEP_PX."""
    count = int(np.ceil(blur_px(camera, speed_mps, seconds, distance_m) / BLUR_STEP_PX)) + 1
    return np.linspace(-0.5, 0.5, int(np.clip(count, 3, 13)))


def blur(camera: Camera, poses: Sequence[Pose], scene: Scene) -> np.ndarray:
    """The mean of the views of several poses within an exposure."""
    return np.mean([view(camera, pose, scene) for pose in poses], axis=0)


def outline(camera: Camera, pose: Pose, scene: Scene, width_px: float = 1.5) -> np.ndarray:
    """(rows, columns) bool: pixels within `width_px` of the platform's rim, for a camera at rest: truth to train on."""
    x, y = ground_points(camera, pose, scene.top_m)
    top = inside(scene.corners_m, x, y).astype(np.uint8)
    size = 2 * int(np.ceil(width_px)) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    return (cv2.dilate(top, kernel) - cv2.erode(top, kernel)) > 0


def _sample(tile: np.ndarray, x: np.ndarray, y: np.ndarray, m_per_px: float) -> np.ndarray:
    """The repeated texture at x, y (m), interpolated bilinearly; its mean for NaN."""
    u, v = (_wrap(np.where(np.isfinite(a), a, 0.0) * np.float32(1.0 / m_per_px)) for a in (x, y))
    grey = cv2.remap(tile, u.astype(np.float32), v.astype(np.float32), cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return grey if np.isfinite(x).all() else np.where(np.isfinite(x), grey, tile.mean())


def _wrap(place_px: np.ndarray) -> np.ndarray:
    """Places modulo TILE_PX; the same bits as np.mod, which is five times slower, for the tile is a power of two."""
    return place_px - np.float32(TILE_PX) * np.floor(place_px / np.float32(TILE_PX))
