"""Rotors that follow their command more slowly (or faster) than declared."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["motor_rise"] *= v["factor"]
    plant["motor_fall"] *= v["factor"] * v["fall"]


EFFECT = Effect(
    "motor_lag", "rotor speed follows the command with another time constant",
    (Parameter("factor", "1", 1.5, 0.1, 5.0, 1.0, "times the declared time constant",
               "brushed motors: 60 ms (authors' flights) to 145 ms (drone-models)"),
     Parameter("fall", "1", 1.0, 0.2, 5.0, 1.0, "slowing down over speeding up",
               "drone-models: slower to fall")),
    settings=settings)
