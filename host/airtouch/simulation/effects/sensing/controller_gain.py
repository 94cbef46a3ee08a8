"""A controller tuned otherwise than declared."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["rate_gain"] *= v["rate"]
    plant["attitude_gain"] *= v["attitude"]
    plant["position_gain"] *= v["position"]
    plant["height_gain"] *= v["height"]


EFFECT = Effect(
    "controller_gain", "gains of the loops over the firmware's defaults",
    (Parameter("rate", "1", 0.7, 0.1, 5.0, 1.0, "rate loop"),
     Parameter("attitude", "1", 1.0, 0.1, 5.0, 1.0, "attitude loop"),
     Parameter("position", "1", 1.0, 0.1, 5.0, 1.0, "horizontal position and velocity"),
     Parameter("height", "1", 1.0, 0.1, 5.0, 1.0, "height and climb")),
    settings=settings)
