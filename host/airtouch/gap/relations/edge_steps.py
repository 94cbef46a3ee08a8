"""What a flight's signals do at the edges that it crosses."""

from functools import cache

import numpy as np

from airtouch.gap.loop.edge_response import BEFORE, KINDS, edges_of
from airtouch.gap.relations.flight_signals import FORCE_LEFT, RANGE_LEFT, SPEED_LEFT, TORQUE_LEFT, FlightSignals

BINS = (*((10 * k, 10 * k + 10) for k in range(8)), (80, 110))  #: samples after an edge of each mean; chosen
GAP = 3  #: samples before an edge that already belong to it; chosen
#: what is looked at; of what has a direction, that of the flight counts
ALONG = {"collective": False, "force x": True, "force z": False, "torque y": True, "speed x": True, "speed z": False,
         "velocity x": True, "climb": False, "pitch": True, "height": False, "range": False}


@cache
def names() -> tuple[str, ...]:
    """Names of what `edge_steps` gives."""
    return tuple(f"{kind} {what}" for kind in KINDS
                 for what in (*(f"{signal} {k}" for signal in ALONG for k in range(len(BINS))), "step"))


def edge_steps(signals: FlightSignals) -> np.ndarray:
    """Steps (len(names()),) of a flight's signals at its edges, the mean over entries and over exits.

    Means of each signal in BINS after an edge less that before it, and the step of the down range; NaN where the flight
    crosses none of a kind.
    """
    flight, out = signals.flight, []
    table = np.column_stack([
        signals.table[:, 0], signals.table[:, FORCE_LEFT.start], signals.table[:, FORCE_LEFT.start + 2],
        signals.table[:, TORQUE_LEFT.start + 1], signals.table[:, SPEED_LEFT.start],
        signals.table[:, SPEED_LEFT.start + 2], signals.velocity[:, 0], signals.velocity[:, 2], signals.angles[:, 1],
        signals.height, signals.table[:, RANGE_LEFT.start]])
    along = np.array(list(ALONG.values()))
    for kind in KINDS:
        steps = []
        for edge in (e for e in edges_of(flight) if e.kind == kind):
            before = table[edge.sample - BEFORE:edge.sample - GAP].mean(axis=0)
            forward = before[list(ALONG).index("velocity x")] >= 0.0
            moved = (table[edge.sample:edge.sample + BINS[-1][1]] - before) * np.where(along & (not forward), -1.0, 1.0)
            steps.append([*np.array([moved[a:b].mean(axis=0) for a, b in BINS]).T.ravel(),
                          edge.height_before_m - edge.height_after_m])
        out.append(np.mean(steps, axis=0) if steps else np.full(len(ALONG) * len(BINS) + 1, np.nan))
    return np.concatenate(out)
