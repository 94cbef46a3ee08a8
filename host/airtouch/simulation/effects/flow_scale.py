"""Optical flow scaled by a height that is not the true distance."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["flow_share"] = v["share"]


EFFECT = Effect(
    "flow_scale", "optical flow scaled by the estimated height over the floor, not the distance to what is below",
    (Parameter("share", "1", 0.05, 0.0, 1.0, 0.0, "0: true distance, 1: estimated height",
               "authors' flights: brakes at 0.5 to 0.7 m/s^2 after entry"),),
    settings=settings)
