"""All four rotors give less thrust than declared at a given command."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["gain"] *= 1.0 - v["loss"]


EFFECT = Effect(
    "thrust_coefficient", "thrust lost on all rotors at a given command",
    (Parameter("loss", "1", 0.1, -0.5, 0.8, 0.0, "fraction of the thrust lost",
               "Bitcraze's curve gives 40.6 g where the authors' drone weighs 36.2 g"),),
    settings=settings)
