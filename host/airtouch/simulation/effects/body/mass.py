"""The vehicle weighs more than declared."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["mass"] *= 1.0 + v["fraction"]


EFFECT = Effect(
    "mass", "added mass, at the centre; inertia as it was",
    (Parameter("fraction", "1", 0.1, -0.5, 1.0, 0.0, "extra mass over declared mass",
               "decks weigh 1 to 5 g of 32"),),
    settings=settings)
