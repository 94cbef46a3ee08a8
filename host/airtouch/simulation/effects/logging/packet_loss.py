"""Samples that never reach the log."""

from airtouch.simulation.effects.effect import Effect, Parameter


def settings(plant, v):
    plant["packet_loss"] = v["share"]
    plant["loss_burst"] = v["burst"]


EFFECT = Effect(
    "packet_loss", "logged samples lost on the radio",
    (Parameter("share", "1", 0.02, 0.0, 0.9, 0.0, "fraction of all samples that is lost"),
     Parameter("burst", "1", 2.0, 1.0, 100.0, None, "samples lost in a row, mean; at least share / (1 - share)")),
    settings=settings, once=True)
