"""Moments of inertia larger than declared."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["inertia"] *= 1.0 + v["fraction"]


EFFECT = Effect(
    "inertia", "extra moment of inertia, all axes",
    (Parameter("fraction", "1", 0.3, -0.6, 3.0, 0.0, "extra over declared",
               "sources differ by 20 to 40 %: 14 (urdf), 16.8 (drone-models) 1e-6 kg m^2"),),
    settings=settings)
