"""The supply voltage falls with the load and as the battery drains."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["battery_strength"] = v["strength"]
    plant["battery_charge"] = v["charge"]
    plant["battery_resistance"] *= v["resistance"]
    plant["battery_capacity"] *= v["capacity"]


EFFECT = Effect(
    "battery_sag", "supply voltage falls with load and charge; thrust with its square",
    (Parameter("strength", "1", 1.0, 0.0, 3.0, 0.0, "1: the vehicle's battery, 0: always the nominal voltage",
               "authors' flights: PWM +70 a second"),
     Parameter("charge", "1", 0.8, 0.05, 1.0, None, "charge at take-off, fraction of the capacity"),
     Parameter("resistance", "1", 1.0, 0.0, 10.0, None, "times the declared internal resistance"),
     Parameter("capacity", "1", 1.0, 0.1, 10.0, None, "times the declared capacity")),
    settings=settings, once=True)
