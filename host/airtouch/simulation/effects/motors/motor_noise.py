"""Thrust that flickers: brushes, bearings, unsteady air in the discs."""

import numpy as np

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    """Add both noises to the plant's, as independent ones; the correlation times are those of the last effect."""
    plant["motor_noise"] = np.hypot(plant["motor_noise"], v["rms"])
    plant["motor_noise_time"] = v["time"]
    plant["motor_hiss"] = np.hypot(plant["motor_hiss"], v["fast"])
    plant["motor_hiss_time"] = v["fast_time"]


EFFECT = Effect(
    "motor_noise", "random thrust of each rotor",
    (Parameter("rms", "1", 0.02, 0.0, 0.5, 0.0, "rms over mean thrust, each rotor",
               "authors' flights: disturbance force noise 0.5 to 0.7 % of weight"),
     Parameter("time", "s", 0.02, 0.002, 2.0, None, "correlation time of the noise `rms`", "guess"),
     Parameter("fast", "1", 0.0, 0.0, 0.5, 0.0, "rms over mean thrust of a second, faster part, each rotor"),
     Parameter("fast_time", "s", 0.01, 0.002, 2.0, None, "correlation time of the faster part")),
    settings=settings)
