"""A weight on a thread below the centre of mass."""

import math

from airtouch.simulation import signals as at
from airtouch.simulation.effects.effect import Effect, Parameter, wrench

LOAD, LENGTH, BELOW, DAMPING, TIED_X, TIED_Y = range(6)
STRETCH = 60.0  #: rad/s, bounce of the load on its thread: stiff against the swing


@wrench
def slung_load(p, s, memory, generator, out):
    # memory: position and velocity of the load from the vehicle, world axes, in a falling
    # frame that moves with the vehicle, so that neither pose nor speed must be known
    length, h = p[LENGTH], s[at.STEP]
    if memory[6] == 0.0:
        memory[2] = -min(length, s[at.HEIGHT])
        memory[6] = 1.0
    x, y, z = memory[0], memory[1], memory[2]
    distance = max(math.sqrt(x * x + y * y + z * z), 1e-6)
    along = (x * memory[3] + y * memory[4] + z * memory[5]) / distance
    pull = 0.0  # over the load's mass
    if distance > length:
        pull = max(STRETCH * STRETCH * (distance - length) + 0.6 * STRETCH * along, 0.0)
    for i in range(3):
        force = -pull * memory[i] / distance - s[at.ACCELERATION + i] - p[DAMPING] * memory[3 + i]
        memory[3 + i] += h * (force - (s[at.GRAVITY] if i == 2 else 0.0))
    for i in range(3):
        memory[i] += h * memory[3 + i]
    if memory[2] < -s[at.HEIGHT]:  # on the floor
        memory[2] = -s[at.HEIGHT]
        memory[3], memory[4], memory[5] = 0.0, 0.0, 0.0
    tension = p[LOAD] * pull / distance
    r = at.ROTATION
    fx = tension * (s[r] * x + s[r + 3] * y + s[r + 6] * z)
    fy = tension * (s[r + 1] * x + s[r + 4] * y + s[r + 7] * z)
    fz = tension * (s[r + 2] * x + s[r + 5] * y + s[r + 8] * z)
    out[0] += fx
    out[1] += fy
    out[2] += fz
    out[3] += p[BELOW] * fy + p[TIED_Y] * fz
    out[4] -= p[BELOW] * fx + p[TIED_X] * fz
    out[5] += p[TIED_X] * fy - p[TIED_Y] * fx


EFFECT = Effect(
    "slung_load", "a weight on a thread",
    (Parameter("load", "kg", 0.003, 0.0, 1.0, 0.0, "mass of the weight", "CrazyPAD: a few grams"),
     Parameter("length", "m", 0.2, 0.02, 2.0, None, "of the thread", "CrazyPAD"),
     Parameter("below", "m", 0.01, 0.0, 0.2, None, "where it is tied, below the centre of mass"),
     Parameter("damping", "1/s", 0.3, 0.0, 20.0, None, "of the swing, by the air"),
     Parameter("x", "m", 0.0, -0.1, 0.1, None, "where it is tied, forward of the centre of mass"),
     Parameter("y", "m", 0.0, -0.1, 0.1, None, "where it is tied, left of the centre of mass")),
    wrench=slung_load)
