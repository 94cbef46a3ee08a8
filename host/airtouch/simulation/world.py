"""What lies below: a floor and platforms of any polygon, each of a material."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.simulation.compiled import jit

#: material -> (ground-effect factor, roughness). A hard smooth surface is 1; soft and porous
#: ones give air room to escape. Set so that the order of the paper's four material pairs
#: (section 7.4) comes out; they are not measurements.
MATERIALS = {
    "cement": (1.00, 1.0), "acrylic": (1.00, 0.9), "mat": (0.85, 1.3),
    "grass": (0.70, 1.8), "water": (0.90, 2.2),
}
LOWER_TOP, LOWER_FACTOR, LOWER_ROUGHNESS, UPPER_TOP, UPPER_FACTOR, UPPER_ROUGHNESS, COVER = range(7)
ABOVE_M = 0.005  #: a surface this far above a rotor is beside it, not below


@dataclass(frozen=True)
class Platform:
    """A raised surface: corners (k, 2) in m, height of its top in m, material."""

    corners_m: np.ndarray
    top_m: float
    material: str = "acrylic"


@dataclass(frozen=True)
class World:
    """Platforms as flat arrays, lowest first; the floor is at height 0.

    corners (total, 2), first (n + 1): corners of platform k are first[k]:first[k + 1];
    surface (n + 1, 3): top, factor, roughness, the floor in the last row; box (n, 4):
    least x, least y, greatest x, greatest y.
    """

    corners: np.ndarray
    first: np.ndarray
    surface: np.ndarray
    box: np.ndarray


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


@jit
def inside_by(corners, start, stop, x, y):
    """How far (x, y) is inside a polygon, m; negative outside."""
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
def below(corners, first, surface, box, x, y, z, radius, out):
    """What lies under a disc of `radius` at (x, y, z): two surfaces and a share, into out (7,).

    Places LOWER_TOP .. COVER: the surface under the whole disc, the higher one under part
    of it, and how much of the disc is over that one (0..1, across a straight edge).
    """
    n = len(first) - 1
    out[LOWER_TOP], out[LOWER_FACTOR], out[LOWER_ROUGHNESS] = surface[n, 0], surface[n, 1], surface[n, 2]
    out[UPPER_TOP], out[UPPER_FACTOR], out[UPPER_ROUGHNESS] = surface[n, 0], surface[n, 1], surface[n, 2]
    out[COVER] = 0.0
    for k in range(n):
        if surface[k, 0] > z + ABOVE_M:
            break
        if (x < box[k, 0] - radius or x > box[k, 2] + radius
                or y < box[k, 1] - radius or y > box[k, 3] + radius):
            continue
        depth = inside_by(corners, first[k], first[k + 1], x, y)
        if depth <= -radius:
            continue
        if depth >= radius or out[COVER] > 0.0:
            # all of the disc is over it, or it stands beside a lower one that already counts
            if depth >= radius:
                out[LOWER_TOP], out[LOWER_FACTOR], out[LOWER_ROUGHNESS] = surface[k, 0], surface[k,
                        1], surface[k, 2]
                out[COVER] = 0.0
                continue
            out[LOWER_TOP], out[LOWER_FACTOR], out[LOWER_ROUGHNESS] = out[UPPER_TOP], out[UPPER_FACTOR], out[
                UPPER_ROUGHNESS]
        out[UPPER_TOP], out[UPPER_FACTOR], out[UPPER_ROUGHNESS] = surface[k, 0], surface[k, 1], surface[k, 2]
        share = depth / radius
        out[COVER] = 0.5 + (math.asin(share) + share * math.sqrt(1.0 - share * share)) / math.pi


@jit
def alike(corners, first, surface, box, x, y, low, high, reach, out):
    """Whether all discs within `reach` of (x, y), between heights low and high, have one whole surface below.

    If so, what `below` gives for each of them is in out (7,).
    """
    n = len(first) - 1
    top = n
    for k in range(n):
        if surface[k, 0] > high + ABOVE_M:
            break
        if (x < box[k, 0] - reach or x > box[k, 2] + reach
                or y < box[k, 1] - reach or y > box[k, 3] + reach):
            continue
        depth = inside_by(corners, first[k], first[k + 1], x, y)
        if depth > -reach:
            if depth < reach or surface[k, 0] > low + ABOVE_M:
                return False
            top = k
    out[LOWER_TOP], out[LOWER_FACTOR], out[LOWER_ROUGHNESS] = surface[top, 0], surface[top, 1], surface[top, 2]
    out[UPPER_TOP], out[UPPER_FACTOR], out[UPPER_ROUGHNESS] = surface[top, 0], surface[top, 1], surface[top, 2]
    out[COVER] = 0.0
    return True


@jit
def top_at(corners, first, surface, box, x, y):
    """Height of the highest surface at the point (x, y), m."""
    for k in range(len(first) - 2, -1, -1):
        if box[k, 0] <= x <= box[k, 2] and box[k, 1] <= y <= box[k, 3]:
            if inside_by(corners, first[k], first[k + 1], x, y) >= 0.0:
                return surface[k, 0]
    return surface[len(first) - 1, 0]


@jit
def first_below(corners, first, surface, box, places):
    """The first of places (n, 3) that is below the surface at its x and y; -1 where none is."""
    for i in range(len(places)):
        if places[i, 2] < top_at(corners, first, surface, box, places[i, 0], places[i, 1]):
            return i
    return -1
