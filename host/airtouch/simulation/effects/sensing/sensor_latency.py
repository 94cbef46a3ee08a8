"""The controller sees what the IMU measured some time ago."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["sensor_delay"] += v["delay"]


EFFECT = Effect(
    "sensor_latency", "delay from the IMU to the controller",
    (Parameter("delay", "s", 0.005, 0.0, 0.1, 0.0,
               "delay from the IMU to the controller, whole steps or not", "firmware: 1 to 2 ms"),),
    settings=settings)
