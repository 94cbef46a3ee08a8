"""The wake of another vehicle overhead: it presses down, rotor by rotor, and shakes.

The wake is a round jet that stands at (x, y) of the world; its push on each rotor falls off with the distance from
the axis as a Gaussian. With a width of 0 it is everywhere: for logs that hold no position, or when the other
vehicle's path is not known and only the time of the passage is.
"""

import math

from airtouch.simulation import signals as at
from airtouch.simulation.effects.effect import Effect, Parameter, wrench
from airtouch.simulation.random_generator import normal

STRENGTH, X, Y, WIDTH, TURBULENCE, TURBULENCE_TIME, SWIRL = range(7)
STEP, DECAY, FRESH = range(8, 11)  #: of the memory: what follows from the step's length


@wrench
def downwash(p, s, memory, generator, out):
    if memory[STEP] != s[at.STEP]:
        memory[STEP], memory[DECAY] = s[at.STEP], math.exp(-s[at.STEP] / p[TURBULENCE_TIME])
        memory[FRESH] = math.sqrt(1.0 - memory[DECAY] ** 2)
    r = at.ROTATION
    quarter = 0.25 * p[STRENGTH] * s[at.MASS] * s[at.GRAVITY]
    spin = -1.0
    for i in range(4):
        spin = -spin  # front right turns as rear left, against the two others
        memory[i] = memory[DECAY] * memory[i] + memory[FRESH] * normal(generator)
        share = 1.0
        if p[WIDTH] > 0.0:
            forward, left = s[at.ROTOR_X + i], s[at.ROTOR_Y + i]
            dx = s[at.POSITION] + s[r] * forward + s[r + 1] * left - p[X]
            dy = s[at.POSITION + 1] + s[r + 3] * forward + s[r + 4] * left - p[Y]
            share = math.exp(-(dx * dx + dy * dy) / (p[WIDTH] * p[WIDTH]))
        unsteady = p[TURBULENCE] * memory[i]
        force = -quarter * share * (1.0 + unsteady)
        out[2] += force
        out[3] += s[at.ROTOR_Y + i] * force
        out[4] -= s[at.ROTOR_X + i] * force
        out[5] += p[SWIRL] * spin * quarter * share * unsteady


EFFECT = Effect(
    "downwash", "the wake of another vehicle overhead, which presses down and shakes",
    (Parameter("strength", "1", 0.25, 0.0, 2.0, 0.0, "downward force on the axis over the weight",
               "Crazyflies 0.15 to 0.3 m under another: 0.15 to 0.42"),
     Parameter("x", "m", 0.0, -1000.0, 1000.0, None, "the wake's axis in the world"),
     Parameter("y", "m", 0.0, -1000.0, 1000.0, None, "the wake's axis in the world"),
     Parameter("width", "m", 0.1, 0.0, 100.0, None,
               "distance at which the push is 1/e of that on the axis; 0: everywhere",
               "Crazyflies: 3 % of the weight 0.15 to 0.25 m aside"),
     Parameter("turbulence", "1", 0.3, 0.0, 5.0, 0.0, "rms of a rotor's push over its mean"),
     Parameter("turbulence_time", "s", 0.02, 0.002, 1.0, None, "correlation time of the turbulence",
               "roll and pitch of Crazyflies under others, neural-swarm: falls off from 8 Hz"),
     Parameter("swirl", "m", 0.01, 0.0, 0.2, None, "unsteady yaw torque over unsteady push of a rotor",
               "Crazyflies under others, neural-swarm: yaw over roll and pitch at 12 to 18 Hz")),
    wrench=downwash)
