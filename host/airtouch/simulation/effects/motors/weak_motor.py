"""One rotor gives less thrust: a chipped propeller, a worn motor."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["gain"][int(v["rotor"]) - 1] *= 1.0 - v["thrust_loss"]


EFFECT = Effect(
    "weak_motor", "one rotor gives less thrust",
    (Parameter("rotor", "1", 1, 1, 4, None, "1 front right, 2 rear right, 3 rear left, 4 front left",
               integer=True),
     Parameter("thrust_loss", "1", 0.1, -0.3, 0.9, 0.0, "fraction of its thrust lost",
               "CrazyPAD: cut propellers")),
    settings=settings)
