"""Logged times that wander around the true ones."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["time_jitter"] = v["rms"]


EFFECT = Effect(
    "time_jitter", "random error of the logged time",
    (Parameter("rms", "s", 0.003, 0.0, 0.2, 0.0, "independent from sample to sample",
               "host arrival times: bursts up to 350 ms"),),
    settings=settings)
