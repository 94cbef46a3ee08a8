"""The height control reacts to the step of the down range at an edge."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["range_residual"] = v["residual"]
    plant["range_kick"] = v["kick"]
    plant["range_mixed"] = v["mixed"]


EFFECT = Effect(
    "range_step", "height control reacts to the down range's step",
    (Parameter("residual", "m", 0.02, -0.3, 0.3, 0.0, "true platform height minus the fixed desk height",
               "paper's fork: a fixed height is added after a drop of more than 0.60 m"),
     Parameter("kick", "m", 0.05, -1.0, 1.0, 0.0, "error of the one reading on which the step is noticed",
               "authors' flights: a thrust kick four samples after nearly every edge"),
     Parameter("mixed", "1", 0.0, 0.0, 1.0, 0.0, "fraction of edges whose one reading in passing mixes both surfaces",
               "authors' flights: nearly every edge")),
    settings=settings)
