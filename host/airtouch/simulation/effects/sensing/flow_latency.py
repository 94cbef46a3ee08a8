"""Optical flow reaches the estimator late."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["flow_delay"] += v["delay"]


EFFECT = Effect(
    "flow_latency", "optical flow reaches the estimator late",
    (Parameter("delay", "s", 0.03, 0.0, 0.3, 0.0, "delay from the picture to the estimator",
               "PMW3901: frames of 8 ms, read every 10 ms, filtered inside"),),
    settings=settings)
