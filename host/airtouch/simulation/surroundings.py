"""The signals that effects see, from the vehicle's state and the world around it."""

import math

from airtouch.simulation import signals as at
from airtouch.simulation import world
from airtouch.simulation.compiled import jit
from airtouch.simulation.rotation import matrix, rotate_back


@jit
def fill(plant, state, slope, speed, corners, first, surface, box, h, t, hover, s, patch):
    """The signals that effects see, for a state (13,), its slope and rotor speeds (4,)."""
    s[at.TIME], s[at.STEP], s[at.MASS], s[at.GRAVITY] = t, h, plant.mass, plant.gravity
    s[at.ROTOR_RADIUS], s[at.ROTOR_SPACING] = plant.rotor_radius, plant.rotor_spacing
    s[at.HOVER_SPEED] = hover
    q = state[6:10]
    vx, vy, vz = rotate_back(q, state[3], state[4], state[5])
    s[at.VELOCITY], s[at.VELOCITY + 1], s[at.VELOCITY + 2] = vx, vy, vz
    for i in range(3):
        s[at.RATES + i] = state[10 + i]
        s[at.ACCELERATION + i] = slope[3 + i]
        s[at.POSITION + i] = state[i]
    r = at.ROTATION
    matrix(q, s, r)
    lowest = 1e9
    x, y = abs(plant.rotor_x[0]) + abs(plant.com[0]), abs(plant.rotor_y[0]) + abs(plant.com[1])
    reach = math.sqrt(x * x + y * y)
    tilt = reach * math.sqrt(s[r + 6] * s[r + 6] + s[r + 7] * s[r + 7])
    alike = world.alike(corners, first, surface, box, state[0], state[1], state[2] - tilt, state[2] + tilt,
                        reach + plant.rotor_radius, patch)
    for i in range(4):
        x, y = plant.rotor_x[i] - plant.com[0], plant.rotor_y[i] - plant.com[1]
        s[at.ROTOR_X + i], s[at.ROTOR_Y + i] = x, y
        s[at.ROTOR_SPEED + i] = speed[i]
        s[at.THRUST + i] = plant.thrust_per_speed2 * speed[i] * speed[i] * plant.gain[i]
        z = state[2] + s[r + 6] * x + s[r + 7] * y
        if not alike:
            world.below(corners, first, surface, box, state[0] + s[r] * x + s[r + 1] * y,
                        state[1] + s[r + 3] * x + s[r + 4] * y, z, plant.rotor_radius, patch)
        s[at.LOWER_HEIGHT + i] = z - patch[world.LOWER_TOP]
        s[at.UPPER_HEIGHT + i] = z - patch[world.UPPER_TOP]
        s[at.COVER + i] = patch[world.COVER]
        s[at.LOWER_FACTOR + i], s[at.UPPER_FACTOR + i] = patch[world.LOWER_FACTOR], patch[world.UPPER_FACTOR]
        s[at.LOWER_ROUGHNESS + i] = patch[world.LOWER_ROUGHNESS]
        s[at.UPPER_ROUGHNESS + i] = patch[world.UPPER_ROUGHNESS]
        lowest = min(lowest, z - (patch[world.UPPER_TOP] if patch[world.COVER] > 0.5
                                  else patch[world.LOWER_TOP]))
    s[at.HEIGHT] = lowest
