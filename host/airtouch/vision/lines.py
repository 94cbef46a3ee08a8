"""The straight edge across an image: maps of edge strength, and the line along which one is strongest.

Two ways to a map: OpenCV's Sobel derivative of the blurred image, and the network. Both are summed along lines that are
nearly square to the flight, so that both are turned into crossings alike.
"""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from airtouch.vision import teed
from airtouch.vision.camera import Camera

TILTS = np.tan(np.radians(np.arange(-24.0, 25.0, 3.0)))  #: of the lines against the image's columns
SIGMA_PX = 2.0  #: blur before the derivative, binned pixels
BORDER_PX = 4  #: columns at each side that the search leaves out

Mapper = Callable[[np.ndarray], np.ndarray]  #: binned image -> strength of an edge at each pixel, about 0 without one


@dataclass(frozen=True)
class Line:
    """The strongest line of an image: its strength, and where it crosses the middle row, pixels of the whole camera."""

    strength: float
    column: float


def shrink(image: np.ndarray) -> np.ndarray:
    """(120, 160) float32: means over 2 x 2 pixels of the middle 240 x 320, a binning that the chip has too."""
    top, left = (image.shape[0] - 240) // 2, (image.shape[1] - 320) // 2
    return image[top:top + 240, left:left + 320].astype(np.float32).reshape(120, 2, 160, 2).mean(axis=(1, 3))


def classical(image: np.ndarray) -> np.ndarray:
    """Signed horizontal derivative after a blur, over its rms: OpenCV's GaussianBlur and Sobel."""
    slope = cv2.Sobel(cv2.GaussianBlur(image, (0, 0), SIGMA_PX), cv2.CV_32F, 1, 0, ksize=3)
    return slope / (float(slope.std()) + 1.0)


def learned_mapper(weights: teed.Weights) -> Mapper:
    """The network's probability of an edge."""
    return lambda image: teed.infer(weights, image)


def strongest(strength: np.ndarray, camera: Camera) -> Line:
    """The line of greatest mean |strength| among those nearly square to the flight. strength: binned (120, 160)."""
    rows, columns = strength.shape
    middle = (rows - 1) / 2.0
    best = Line(0.0, 0.0)
    for tilt in TILTS:
        shear = np.array([[1.0, tilt, -tilt * middle], [0.0, 1.0, 0.0]], np.float32)
        moved = cv2.warpAffine(strength, shear, (columns, rows), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        profile = np.abs(moved.mean(axis=0))
        profile[:BORDER_PX] = profile[columns - BORDER_PX:] = 0.0
        place = int(np.argmax(profile))
        if profile[place] > best.strength:
            best = Line(float(profile[place]), 2.0 * (place + _peak(profile, place)) + 0.5 + (camera.width - 320) // 2)
    return best


def _peak(profile: np.ndarray, place: int) -> float:
    """Distance, in pixels, of the vertex of a parabola through three values from the middle one."""
    if not 0 < place < len(profile) - 1:
        return 0.0
    left, middle, right = profile[place - 1:place + 2]
    curve = left - 2.0 * middle + right
    return float(np.clip(0.5 * (left - right) / curve, -0.5, 0.5)) if curve < 0.0 else 0.0
