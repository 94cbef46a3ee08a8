"""Force and torque on the body at the middle of a physics step: what effects see, every effect, the legs."""

import math

import numpy as np

from airtouch.simulation import signals as at
from airtouch.simulation.body import contact
from airtouch.simulation.body.rigid_body import STATE_SIZE
from airtouch.simulation.body.rotation import matrix, rotate_back
from airtouch.simulation.compiled import inlined, jit
from airtouch.simulation.effects import slots
from airtouch.simulation.effects.effect import MEMORY
from airtouch.simulation.flight_plan import world

_F = np.float64
STATE = np.dtype([
    ("memory", _F, (slots.SLOTS, MEMORY)),  # what each effect keeps from step to step
    ("signals", _F, (at.COUNT,)),  # what effects see
    ("state", _F, (STATE_SIZE,)),  # of the body, at the middle of the step
    ("rotor_speed", _F, (4,)),  # rad/s, there
    ("deepest", _F),  # m, how deep the deepest leg stands in a surface
])


@inlined
def act(plant, state, ground, effects, hover_speed):
    """The effects' stage of a physics step: body.wrench, and state.forces.deepest.

    ground: World; effects: EffectSlots; hover_speed: rad/s of a rotor in hover.
    """
    s, body = state.forces, state.body
    _middle(plant, s, body)
    _fill(plant, state, ground, hover_speed)
    for i in range(6):
        body.wrench[i] = 0.0
    slots.add(effects, s.signals[:], s.memory, body.wrench[:])
    s.deepest = contact.legs(plant, s.state, s.signals, body.wrench)


@jit
def _middle(plant, s, body):
    """State and rotor speeds at the middle of the step, to first order."""
    h = plant.step
    for i in range(STATE_SIZE):
        s.state[i] = body.state[i] + 0.5 * h * body.slope[i]
    for i in range(4):
        tau = plant.motor_rise if body.target_speed[i] > body.rotor_speed[i] else plant.motor_fall
        s.rotor_speed[i] = body.rotor_speed[i] + 0.5 * h / tau * (body.target_speed[i] - body.rotor_speed[i])


@inlined
def _fill(plant, state, ground, hover_speed):
    """The signals that effects see, at the middle of the step."""
    s, pose, slope = state.forces.signals, state.forces.state, state.body.slope
    s[at.TIME], s[at.STEP] = state.time_s + 0.5 * plant.step, plant.step
    s[at.MASS], s[at.GRAVITY] = plant.mass, plant.gravity
    s[at.ROTOR_RADIUS], s[at.ROTOR_SPACING] = plant.rotor_radius, plant.rotor_spacing
    s[at.HOVER_SPEED] = hover_speed
    q = pose[6:10]
    vx, vy, vz = rotate_back(q, pose[3], pose[4], pose[5])
    s[at.VELOCITY], s[at.VELOCITY + 1], s[at.VELOCITY + 2] = vx, vy, vz
    for i in range(3):
        s[at.RATES + i] = pose[10 + i]
        s[at.ACCELERATION + i] = slope[3 + i]
        s[at.POSITION + i] = pose[i]
    matrix(q, s, at.ROTATION)
    below_all, lowest = _common_surface(plant, pose, s, ground), 1e9
    for i in range(4):
        lowest = min(lowest, _rotor(plant, state, ground, below_all, i))
    s[at.HEIGHT] = lowest


@inlined
def _common_surface(plant, pose, s, ground):
    """The row of World.surface below all four discs, or world.NONE."""
    r = at.ROTATION
    x, y = abs(plant.rotor_x[0]) + abs(plant.com[0]), abs(plant.rotor_y[0]) + abs(plant.com[1])
    reach = math.sqrt(x * x + y * y)
    tilt = reach * math.sqrt(s[r + 6] * s[r + 6] + s[r + 7] * s[r + 7])
    return world.common(ground, pose[0], pose[1], pose[2] - tilt, pose[2] + tilt, reach + plant.rotor_radius)


@inlined
def _rotor(plant, state, ground, below_all, i):
    """The signals of rotor i; below_all: row of the surface below all rotors, or world.NONE.

    Returns its height over what is below, m.
    """
    s, pose, speed, r = state.forces.signals, state.forces.state, state.forces.rotor_speed[i], at.ROTATION
    x, y = plant.rotor_x[i] - plant.com[0], plant.rotor_y[i] - plant.com[1]
    s[at.ROTOR_X + i], s[at.ROTOR_Y + i] = x, y
    s[at.ROTOR_SPEED + i] = speed
    s[at.THRUST + i] = plant.thrust_per_speed2 * speed * speed * state.body.gain[i]
    z = pose[2] + s[r + 6] * x + s[r + 7] * y
    lower, upper, cover = below_all, below_all, 0.0
    if below_all == world.NONE:
        lower, upper, cover = world.below(ground, pose[0] + s[r] * x + s[r + 1] * y,
                                          pose[1] + s[r + 3] * x + s[r + 4] * y, z, plant.rotor_radius)
    surface = ground.surface
    s[at.LOWER_HEIGHT + i] = z - surface[lower, world.TOP]
    s[at.UPPER_HEIGHT + i] = z - surface[upper, world.TOP]
    s[at.COVER + i] = cover
    s[at.LOWER_FACTOR + i], s[at.UPPER_FACTOR + i] = surface[lower, world.FACTOR], surface[upper, world.FACTOR]
    s[at.LOWER_ROUGHNESS + i] = surface[lower, world.ROUGHNESS]
    s[at.UPPER_ROUGHNESS + i] = surface[upper, world.ROUGHNESS]
    return z - surface[upper if cover > 0.5 else lower, world.TOP]
