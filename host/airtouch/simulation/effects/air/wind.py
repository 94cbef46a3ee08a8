"""Steady wind: the air's velocity acts through the rotors' drag, at a height over the centre of mass.

With a lever the moment is linear in the air's velocity: the matrix A of Faessler, Franchi and
Scaramuzza 2018 (torque -A R^T v), whose only entries here are those of a force off the centre.
"""

from airtouch.simulation import signals as at
from airtouch.simulation.effects.effect import Effect, Parameter, wrench

X, Y, Z, DRAG, LEVER = range(5)


@wrench
def wind(p, s, memory, generator, out):
    total = s[at.ROTOR_SPEED] + s[at.ROTOR_SPEED + 1] + s[at.ROTOR_SPEED + 2] + s[at.ROTOR_SPEED + 3]
    drag = p[DRAG] * total / (4.0 * s[at.HOVER_SPEED])
    r = at.ROTATION
    force_x = drag * (s[r] * p[X] + s[r + 3] * p[Y] + s[r + 6] * p[Z])
    force_y = drag * (s[r + 1] * p[X] + s[r + 4] * p[Y] + s[r + 7] * p[Z])
    out[0] += force_x
    out[1] += force_y
    out[3] -= p[LEVER] * force_y
    out[4] += p[LEVER] * force_x


EFFECT = Effect(
    "wind", "steady wind, through the rotors' horizontal drag",
    (Parameter("x", "m/s", 0.3, -10.0, 10.0, 0.0, "towards world x", "paper, section 7.7: 0 to 0.3 m/s"),
     Parameter("y", "m/s", 0.0, -10.0, 10.0, 0.0, "towards world y"),
     Parameter("z", "m/s", 0.0, -10.0, 10.0, 0.0, "upwards"),
     Parameter("drag", "N s/m", 0.0147, 0.0, 2.0, None, "horizontal drag at hover", "drone-models"),
     Parameter("lever", "m", 0.0, -0.1, 0.1, 0.0, "where the drag acts, over the centre of mass",
               "discs of a Crazyflie 2.1: 0.01; with hub moments and inflow skew more")),
    wrench=wind)
