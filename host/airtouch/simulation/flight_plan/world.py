"""What lies below: a floor and platforms of any polygon, each of a material."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import float64, int64, types

from airtouch.errors import AirTouchError
from airtouch.simulation.compiled import jit

#: material -> (ground-effect factor, roughness). A hard smooth surface is 1; soft and porous
#: ones give air room to escape. Set so that the order of the paper's four material pairs
#: (section 7.4) comes out; they are not measurements.
MATERIALS = {
    "cement": (1.00, 1.0), "acrylic": (1.00, 0.9), "mat": (0.85, 1.3),
    "grass": (0.70, 1.8), "water": (0.90, 2.2),
}
TOP, FACTOR, ROUGHNESS = range(3)  #: columns of World.surface: height in m, ground-effect factor, roughness
NONE = -1  #: no row of World.surface, no place
ABOVE_M = 0.005  #: a surface this far above a rotor is beside it, not below


@dataclass(frozen=True)
class Platform:
    """A raised surface: corners (k, 2) in m, height of its top in m, material."""

    corners_m: np.ndarray
    top_m: float
    material: str = "acrylic"


class World(NamedTuple):
    """Platforms as flat arrays, lowest first; the floor is at height 0.

    corners (total, 2), first (n + 1): corners of platform k are first[k]:first[k + 1];
    surface (n + 1, 3): TOP, FACTOR, ROUGHNESS, the floor in the last row; box (n, 4):
    least x, least y, greatest x, greatest y.
    """

    corners: np.ndarray
    first: np.ndarray
    surface: np.ndarray
    box: np.ndarray


WORLD = types.NamedTuple((float64[:, ::1], int64[::1], float64[:, ::1], float64[:, ::1]), World)  #: in compiled code


def build(platforms: Sequence[Platform], floor: str = "cement") -> World:
    """A world of platforms over a floor. Raises AirTouchError for an unknown material or bad polygon."""
    platforms = sorted(platforms, key=lambda p: p.top_m)
    for material in [floor, *(p.material for p in platforms)]:
        if material not in MATERIALS:
            raise AirTouchError(f"no material {material!r}; known: {', '.join(MATERIALS)}")
    outlines = [np.asarray(p.corners_m, dtype=np.float64) for p in platforms]
    for outline in outlines:
        if outline.ndim != 2 or outline.shape[1] != 2 or len(outline) < 3 or not np.isfinite(outline).all():
            raise AirTouchError("a platform needs three corners or more, each of two finite numbers")
    corners = np.concatenate(outlines) if outlines else np.zeros((0, 2))
    first = np.cumsum([0] + [len(o) for o in outlines])
    surface = np.array([[p.top_m, *MATERIALS[p.material]] for p in platforms] + [[0.0, *MATERIALS[floor]]])
    box = np.array([[*o.min(0), *o.max(0)] for o in outlines]).reshape(-1, 4)
    return World(corners, first.astype(np.int64), surface, box)


def inside(corners: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """True for positions (any shape) inside a convex polygon; False for NaN. corners: (k, 2), anticlockwise."""
    ahead = np.roll(corners, -1, axis=0) - corners
    within = np.ones(np.shape(x), bool)
    for (cx, cy), (dx, dy) in zip(corners, ahead, strict=True):
        within &= dx * (y - cy) - dy * (x - cx) >= 0.0
    return within


@jit
def inside_by(corners, start, stop, x, y):
    """Distance from (x, y) to the border of a polygon, m; positive inside, negative outside."""
    nearest = 1e30
    inside = False
    j = stop - 1
    for i in range(start, stop):
        ax, ay = corners[j, 0], corners[j, 1]
        bx, by = corners[i, 0], corners[i, 1]
        if (ay > y) != (by > y) and x < (bx - ax) * (y - ay) / (by - ay) + ax:
            inside = not inside
        ex, ey = bx - ax, by - ay
        along = ((x - ax) * ex + (y - ay) * ey) / max(ex * ex + ey * ey, 1e-30)
        along = min(max(along, 0.0), 1.0)
        dx, dy = x - ax - along * ex, y - ay - along * ey
        nearest = min(nearest, dx * dx + dy * dy)
        j = i
    return math.sqrt(nearest) if inside else -math.sqrt(nearest)


@jit
def _beyond(world, k, x, y, distance):
    """Whether (x, y) is further than `distance` m outside the box around platform k."""
    box = world.box
    return (x < box[k, 0] - distance or x > box[k, 2] + distance
            or y < box[k, 1] - distance or y > box[k, 3] + distance)


@jit
def below(world, x, y, z, radius):
    """The surfaces under a disc of `radius` m at (x, y, z): lower, upper, cover.

    lower: row of World.surface under the disc; upper: row of the higher one under part of it; cover: share of the disc
    over that one, 0..1, as across a straight edge. With a cover of 0 upper means nothing. Where several platforms each
    reach under a part of the disc, lower and upper are the highest two of them, as if the lower one were under all of
    the rest; what is between and beside them is left out.
    """
    n = len(world.first) - 1
    lower, upper, cover = n, n, 0.0
    for k in range(n):
        if world.surface[k, TOP] > z + ABOVE_M:
            break
        if _beyond(world, k, x, y, radius):
            continue
        depth = inside_by(world.corners, world.first[k], world.first[k + 1], x, y)
        if depth <= -radius:
            continue
        if depth >= radius:
            lower, cover = k, 0.0
            continue
        if cover > 0.0:  # it stands beside a lower one that already covers a part
            lower = upper
        share = depth / radius
        upper, cover = k, 0.5 + (math.asin(share) + share * math.sqrt(1.0 - share * share)) / math.pi
    return lower, upper, cover


@jit
def common(world, x, y, low, high, reach):
    """The row of World.surface below every disc within `reach` m of (x, y), between heights low and high (m).

    NONE where an edge, or a platform between the two heights, sets discs apart.
    """
    surface_row = len(world.first) - 1
    for k in range(len(world.first) - 1):
        if world.surface[k, TOP] > high + ABOVE_M:
            break
        if _beyond(world, k, x, y, reach):
            continue
        depth = inside_by(world.corners, world.first[k], world.first[k + 1], x, y)
        if depth > -reach:
            if depth < reach or world.surface[k, TOP] > low + ABOVE_M:
                return NONE
            surface_row = k
    return surface_row


@jit
def top_at(world, x, y):
    """Height of the highest surface at the point (x, y), m."""
    for k in range(len(world.first) - 2, -1, -1):
        if not _beyond(world, k, x, y, 0.0):
            if inside_by(world.corners, world.first[k], world.first[k + 1], x, y) >= 0.0:
                return world.surface[k, TOP]
    return world.surface[len(world.first) - 1, TOP]


@jit
def first_below(world, places):
    """Index of the first of places (n, 3) that is below the surface at its x and y; NONE if there is none."""
    for i in range(len(places)):
        if places[i, 2] < top_at(world, places[i, 0], places[i, 1]):
            return i
    return NONE
