"""Distances to the walls against where shapely sees a ray meet them."""

import numpy as np
import pytest

from airtouch.simulation.sensors.multi_ranger import DIRECTIONS_RAD, wall_distance

shapely = pytest.importorskip("shapely", reason="the extra 'map'")
ROOM = np.array([-1.5, 2.5, -3.0, 1.0])  # x0, x1, y0, y1


@pytest.mark.parametrize("seed", range(5))
def test_a_beam_ends_at_the_wall(seed):
    rng = np.random.default_rng(seed)
    walls = shapely.box(ROOM[0], ROOM[2], ROOM[1], ROOM[3]).exterior
    for _ in range(50):
        x, y, way = rng.uniform(-1.4, 2.4), rng.uniform(-2.9, 0.9), rng.uniform(-np.pi, np.pi)
        ray = shapely.LineString([(x, y), (x + 20.0 * np.cos(way), y + 20.0 * np.sin(way))])
        assert wall_distance(x, y, way, ROOM) == pytest.approx(shapely.Point(x, y).distance(ray.intersection(walls)))


def test_beams_look_to_the_front_the_back_the_left_and_the_right():
    """From (0.5, 0) with the nose along x; left is +y."""
    assert [wall_distance(0.5, 0.0, d, ROOM) for d in DIRECTIONS_RAD] == pytest.approx([2.0, 2.0, 1.0, 3.0])


@pytest.mark.parametrize("place", [(-2.0, 0.0), (3.0, 0.0), (0.0, -4.0), (0.0, 2.0)])
def test_outside_the_room_there_is_no_wall_to_see(place):
    assert all(np.isnan(wall_distance(*place, d, ROOM)) for d in DIRECTIONS_RAD)
