"""Drag of the spinning rotors: force against the velocity, in the disc plane and across it."""

from airtouch.simulation import signals as at
from airtouch.simulation.effects.effect import Effect, Parameter, wrench

HORIZONTAL, VERTICAL = range(2)


@wrench
def rotor_drag(p, s, memory, generator, out):
    total = s[at.ROTOR_SPEED] + s[at.ROTOR_SPEED + 1] + s[at.ROTOR_SPEED + 2] + s[at.ROTOR_SPEED + 3]
    spin = total / (4.0 * s[at.HOVER_SPEED])
    out[0] -= p[HORIZONTAL] * spin * s[at.VELOCITY]
    out[1] -= p[HORIZONTAL] * spin * s[at.VELOCITY + 1]
    out[2] -= p[VERTICAL] * spin * s[at.VELOCITY + 2]


EFFECT = Effect(
    "rotor_drag", "drag of the rotors, linear in speed over ground and in rotor speed",
    (Parameter("horizontal", "N s/m", 0.0147, 0.0, 2.0, 0.0, "drag in the disc plane, at hover",
               "drone-models 0.0147; Foerster 2015 0.0056"),
     Parameter("vertical", "N s/m", 0.0, 0.0, 2.0, 0.0, "drag along the rotor axis, at hover",
               "Foerster 2015: about 0.01")),
    wrench=rotor_drag)
