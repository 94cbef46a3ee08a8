"""Optical flow scaled by a height that is not the true distance."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["flow_share"] = v["share"]
    plant["flow_transient"] = v["transient"]
    plant["flow_transient_time"] = v["time"]
    plant["flow_transient_wait"], plant["flow_transient_above"] = v["wait"], v["above"]
    plant["flow_focus"] = v["focus"]


EFFECT = Effect(
    "flow_scale",
    "optical flow scaled by the estimated height over the floor, not the distance to what is below",
    (Parameter("share", "1", 0.05, -0.1, 1.0, 0.0,
               "0: true distance, 1: estimated height; negative: the sensor, out of "
               "focus, sees too little", "authors' flights speed up over the platform and brake at its end"),
     Parameter("transient", "1", 0.0, -1.0, 1.0, 0.0, "the same, added where what is below has just changed",
               "authors' flights: brake at 0.5 to 0.7 m/s^2 after entry"),
     Parameter("time", "s", 0.2, 0.02, 5.0, None, "in which that dies out"),
     Parameter("wait", "s", 0.0, 0.0, 1.0, None, "from the change below to the beginning of that",
               "authors' high flights brake from 0.12 s after the entry on"),
     Parameter("above", "m", 0.0, 0.0, 0.5, None, "only at this distance or more; closer, the picture is out of focus",
               "authors' flights: at 9 cm they brake after the entry, at 6 cm and less they do not"),
     Parameter("focus", "m", 0.08, 0.01, 0.3, 0.08, "least distance to which the picture scales",
               "PMW3901: working range from 80 mm")),
    settings=settings, once=True)
