"""The Multi-ranger: distances to the walls, front, back, left, right."""

import math

import numpy as np

from airtouch.simulation.body.rotation import euler
from airtouch.simulation.compiled import jit
from airtouch.simulation.sensors.ranging import MAX_RANGE_M

PERIOD_STEPS = 50  #: physics steps a reading
DIRECTIONS_RAD = (0.0, math.pi, 0.5 * math.pi, -0.5 * math.pi)  #: of the four beams from the nose


@jit
def read(state, room):
    """Distances (m, NaN: none) to the walls of room (4,) into state.walls (4,), when they are due."""
    if state.step % PERIOD_STEPS != 0:
        return
    pose = state.body.state
    _, _, yaw = euler(pose[6:10])
    for i in range(4):
        far = wall_distance(pose[0], pose[1], yaw + DIRECTIONS_RAD[i], room)
        state.walls[i] = far if far <= MAX_RANGE_M else np.nan


@jit
def wall_distance(x, y, direction, room):
    """Distance in m from (x, y) along `direction` (rad) to the wall of room (x0, x1, y0, y1).

    NaN outside the room.
    """
    if not (room[0] <= x <= room[1] and room[2] <= y <= room[3]):
        return math.nan
    c, s = math.cos(direction), math.sin(direction)
    far = 1e9
    if c > 1e-9:
        far = min(far, (room[1] - x) / c)
    elif c < -1e-9:
        far = min(far, (room[0] - x) / c)
    if s > 1e-9:
        far = min(far, (room[3] - y) / s)
    elif s < -1e-9:
        far = min(far, (room[2] - y) / s)
    return far
