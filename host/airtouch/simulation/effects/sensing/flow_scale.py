"""Optical flow of the true distance, which the estimator divides by its height over the floor."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["flow_share"] = v["share"]
    plant["flow_transient"] = v["transient"]
    plant["flow_transient_time"] = v["time"]
    plant["flow_transient_wait"], plant["flow_transient_above"] = v["wait"], v["above"]
    plant["flow_focus"] = v["focus"]


EFFECT = Effect(
    "flow_scale",
    "optical flow as at the distance to what is below, not at the estimated height over the floor",
    (Parameter("share", "1", 0.05, -0.1, 1.0, 0.0,
               "0: counts as at the estimator's height, which gives the true velocity; 1: as at the distance to what "
               "is below; negative: the sensor, out of focus, sees too little",
               "authors' flights speed up over the platform and brake at its end"),
     Parameter("transient", "1", 0.0, -1.0, 1.0, 0.0, "added to `share` when what is below has just changed",
               "authors' flights: brake at 0.5 to 0.7 m/s^2 after entry"),
     Parameter("time", "s", 0.2, 0.02, 5.0, None, "time constant with which `transient` dies out"),
     Parameter("wait", "s", 0.0, 0.0, 1.0, None, "from the change of what is below to the beginning of `transient`",
               "authors' high flights brake from 0.12 s after the entry on"),
     Parameter("above", "m", 0.0, 0.0, 0.5, None,
               "least distance at which `transient` acts; closer, the picture is out of focus",
               "authors' flights: at 9 cm they brake after the entry, at 6 cm and less they do not"),
     Parameter("focus", "m", 0.08, 0.01, 0.3, 0.08, "least distance to which the picture scales",
               "PMW3901: working range from 80 mm")),
    settings=settings, once=True)
