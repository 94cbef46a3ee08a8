"""Blade flapping: in forward flight the rotor discs tilt back."""

from airtouch.simulation import signals as at
from airtouch.simulation.effects.effect import Effect, Parameter, wrench

TILT, HUB, ABOVE, MOMENT = range(4)


@wrench
def blade_flapping(p, s, memory, generator, out):
    thrust = s[at.THRUST] + s[at.THRUST + 1] + s[at.THRUST + 2] + s[at.THRUST + 3]
    back_x, back_y = p[TILT] * s[at.VELOCITY], p[TILT] * s[at.VELOCITY + 1]
    out[0] -= thrust * back_x
    out[1] -= thrust * back_y
    # the force acts at the discs above the centre of mass, and stiff hubs hand on the blades' moment
    out[3] += thrust * ((p[ABOVE] + p[HUB]) * back_y + p[MOMENT] * s[at.VELOCITY + 1])
    out[4] -= thrust * ((p[ABOVE] + p[HUB]) * back_x + p[MOMENT] * s[at.VELOCITY])


EFFECT = Effect(
    "blade_flapping", "rotor discs tilt back with speed: drag and a moment that lifts the nose",
    (Parameter("tilt", "rad s/m", 0.01, 0.0, 0.2, 0.0, "disc tilt per speed",
               "Pounds, Mahony, Corke 2010; Crazyflie blades are stiff, so an upper guess"),
     Parameter("hub", "m", 0.005, 0.0, 0.1, None,
               "moment of the stiff hub over the disc's horizontal force", "guess"),
     Parameter("above", "m", 0.01, -0.05, 0.2, None, "discs above the centre of mass",
               "Crazyflie 2.1, measured on drawings"),
     Parameter("moment", "s", 0.0, -0.02, 0.02, 0.0,
               "moment without a force, over thrust and speed; negative: it lowers the nose, as RotorPy's k_flap")),
    wrench=blade_flapping)
