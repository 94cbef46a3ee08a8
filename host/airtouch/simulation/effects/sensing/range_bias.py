"""The down range reads wrong near a surface, wrong just after an entry, and late."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["range_bias"], plant["range_bias_fade"] = v["near"], v["fade"]
    plant["range_dip"], plant["range_dip_time"], plant["range_dip_fade"] = v["dip"], v["time"], v["dip_fade"]
    plant["range_delay"], plant["range_reach"] = v["delay"], v["reach"]


EFFECT = Effect(
    "range_bias", "the down range reads wrong near a surface, too little just after an entry, and late",
    (Parameter("near", "m", -0.02, -0.2, 0.2, 0.0, "error of a reading at distance 0",
               "authors' flights: readings of 0 to 1 cm where their lift says 3 cm"),
     Parameter("fade", "m", 0.03, 0.005, 0.5, None, "distance over which the error `near` dies out"),
     Parameter("dip", "m", -0.03, -0.2, 0.2, 0.0, "error of a reading just after a higher surface came below",
               "authors' low flights: 0.1 cm at 0.1 s after the entry, 2.2 cm at 0.3 s, 5 cm at 0.5 s"),
     Parameter("time", "s", 0.15, 0.02, 2.0, None, "time constant with which the error `dip` dies out"),
     Parameter("dip_fade", "m", 0.0, 0.0, 0.5, None,
               "distance over which the error `dip` dies out as well; 0: it is the same at any distance",
               "authors' flights: 1.3 cm at 6 cm, 0.7 cm at 9 cm"),
     Parameter("delay", "s", 0.0, 0.0, 0.3, 0.0, "delay of each reading, in log and estimator; whole milliseconds",
               "VL53L1x: 25 ms of ranging, read every 25 ms"),
     Parameter("reach", "m", 0.0, 0.0, 0.2, 0.0, "a higher surface is seen from this far beside the beam",
               "authors' flights: the lift begins 0.1 s after the reading has changed, and ends 0.1 s before")),
    settings=settings, once=True)
