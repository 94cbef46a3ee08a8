"""Motors get their command some time after it was given."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["actuator_delay"] += v["delay"]


EFFECT = Effect(
    "actuator_delay", "delay from command to motor",
    (Parameter("delay", "s", 0.008, 0.0, 0.1, 0.0, "time by which the logged command leads the thrust",
               "authors' flights: 20 ms"),),
    settings=settings)
