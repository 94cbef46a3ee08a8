"""Legs on a surface: springs with damping and friction under the four rotors."""

import math

from airtouch.simulation import signals as at
from airtouch.simulation.body.rotation import rotate_back
from airtouch.simulation.compiled import jit

SINK_M = 0.002  #: m that the legs give under the vehicle's weight; chosen: it bounces at 11 Hz, 45 steps a period
DAMPING = 0.5  #: of the bounce, critical is 1; chosen: each swing is a sixth of the one before
FRICTION_S = 0.02  #: s, time constant with which sliding dies out under full weight; chosen, not measured


@jit
def legs(plant, pose, s, force):
    """Add force and torque of the legs to force (6,), N and N m; returns the depth of the deepest leg in a surface, m.

    Friction turns the vehicle about its z axis alone. Left out is its torque about x and y, (leg fy, -leg fx) of a
    foot `leg` below the centre of mass: what was learned from simulated landings was learned without it.

    pose (13,): state of the body; s (COUNT,): its signals.
    """
    leg = plant.range_below_rotors + plant.leg_below_range
    if s[at.HEIGHT] >= leg:
        return 0.0
    deepest = 0.0
    weight = 0.25 * plant.mass * plant.gravity
    stiffness = weight / SINK_M
    damping = 2.0 * DAMPING * math.sqrt(stiffness * 0.25 * plant.mass)
    r = at.ROTATION
    for i in range(4):
        cover = s[at.COVER + i]
        height = s[at.UPPER_HEIGHT + i] if cover > 0.5 else s[at.LOWER_HEIGHT + i]
        depth = leg * s[r + 8] - height
        if depth <= 0.0:
            continue
        deepest = max(deepest, depth)
        x, y = s[at.ROTOR_X + i], s[at.ROTOR_Y + i]
        # velocity of the leg over ground, in body axes then in world axes
        bx = s[at.VELOCITY] - pose[12] * y
        by = s[at.VELOCITY + 1] + pose[12] * x
        bz = s[at.VELOCITY + 2] + pose[10] * y - pose[11] * x
        vx = s[r] * bx + s[r + 1] * by + s[r + 2] * bz
        vy = s[r + 3] * bx + s[r + 4] * by + s[r + 5] * bz
        vz = s[r + 6] * bx + s[r + 7] * by + s[r + 8] * bz
        push = max(stiffness * depth - damping * vz, 0.0)
        grip = -push / (plant.gravity * FRICTION_S)
        fx, fy, fz = rotate_back(pose[6:10], grip * vx, grip * vy, push)
        force[0] += fx
        force[1] += fy
        force[2] += fz
        force[3] += y * fz
        force[4] -= x * fz
        force[5] += x * fy - y * fx
    return deepest
