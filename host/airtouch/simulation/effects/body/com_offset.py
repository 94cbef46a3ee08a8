"""The centre of mass is not under the middle of the rotors."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["com"] += (v["x"], v["y"], v["z"])


EFFECT = Effect(
    "com_offset", "centre of mass off the middle of the rotors",
    (Parameter("x", "m", 0.001, -0.05, 0.05, 0.0, "forward", "a battery slid by 3 mm moves it by 1 mm"),
     Parameter("y", "m", 0.0, -0.05, 0.05, 0.0, "to the left"),
     Parameter("z", "m", 0.0, -0.05, 0.05, 0.0, "upwards; moves the accelerometer alone, and in a replay nothing")),
    settings=settings)
