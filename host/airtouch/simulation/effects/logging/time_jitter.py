"""Logged times that wander around the true ones, and where in the controllers' cycle a row is logged."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["time_jitter"] = v["rms"]
    plant["controller_ahead"] = v["behind"]


EFFECT = Effect(
    "time_jitter", "random error of the logged time",
    (Parameter("rms", "s", 0.003, 0.0, 0.2, 0.0, "error of the logged time, independent from sample to sample",
               "host arrival times: bursts up to 350 ms"),
     Parameter("behind", "s", 0.004, 0.0, 0.01, None,
               "time of a logged row after the last run of position controller and prediction, whole 2 ms",
               "authors' flights: the 2 ms kick of a set-point step is in the log in some flights only")),
    settings=settings, once=True)
