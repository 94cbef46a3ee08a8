"""What a flight's signals do at the edges that it crosses."""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from airtouch.gap.edges.edge_response import BEFORE, KINDS, UNSURE, edges_in_air
from airtouch.gap.features.feature import Feature
from airtouch.gap.features.flight_signals import (
    COMMAND,
    FORCE_RESIDUAL,
    RANGE_RESIDUAL,
    SPEED_RESIDUAL,
    TORQUE_RESIDUAL,
    FlightSignals,
)

BINS = (*((10 * k, 10 * k + 10) for k in range(8)), (80, 110))  #: samples after an edge of each mean; chosen


class Signal(NamedTuple):
    """A signal that is looked at. along: it has a direction, of which that of the flight counts; values: (n,)."""

    name: str
    along: bool
    values: Callable[[FlightSignals], np.ndarray]


SIGNALS = (
    Signal("thrust command", False, lambda s: s.table[:, COMMAND.start]),
    Signal("force residual x", True, lambda s: s.table[:, FORCE_RESIDUAL.start]),
    Signal("force residual z", False, lambda s: s.table[:, FORCE_RESIDUAL.start + 2]),
    Signal("torque residual y", True, lambda s: s.table[:, TORQUE_RESIDUAL.start + 1]),
    Signal("speed residual x", True, lambda s: s.table[:, SPEED_RESIDUAL.start]),
    Signal("speed residual z", False, lambda s: s.table[:, SPEED_RESIDUAL.start + 2]),
    Signal("velocity x", True, lambda s: s.velocity[:, 0]),
    Signal("climb", False, lambda s: s.velocity[:, 2]),
    Signal("pitch", True, lambda s: s.angles[:, 1]),
    Signal("height", False, lambda s: s.height),
    Signal("range residual", False, lambda s: s.table[:, RANGE_RESIDUAL.start]),
)
VELOCITY = [s.name for s in SIGNALS].index("velocity x")  #: by its sign the flight goes forward


@cache
def declared_features() -> tuple[Feature, ...]:
    """What `edge_step_features` gives: kind of edge, signal, number of the mean in BINS; step of the down range."""
    return tuple(Feature(f"{kind} {what}") for kind in KINDS
                 for what in (*(f"{s.name} {k}" for s in SIGNALS for k in range(len(BINS))), "step"))


def edge_step_features(signals: FlightSignals) -> np.ndarray:
    """Steps (len(declared_features()),) of a flight's signals at its edges, the mean over entries and over exits.

    Means of each signal in BINS after an edge less that before it, and the step of the down range, m; NaN where the
    flight crosses none of a kind.
    """
    edges, values = edges_in_air(signals.flight), np.column_stack([s.values(signals) for s in SIGNALS])
    along, out = np.array([s.along for s in SIGNALS]), []
    for kind in KINDS:
        steps = []
        for edge in (e for e in edges if e.kind == kind):
            before = values[edge.sample - BEFORE:edge.sample - UNSURE].mean(axis=0)
            backward = before[VELOCITY] < 0.0
            moved = (values[edge.sample:edge.sample + BINS[-1][1]] - before) * np.where(along & backward, -1.0, 1.0)
            steps.append([*np.array([moved[a:b].mean(axis=0) for a, b in BINS]).T.ravel(),
                          edge.height_before_m - edge.height_after_m])
        out.append(np.mean(steps, axis=0) if steps else np.full(len(SIGNALS) * len(BINS) + 1, np.nan))
    return np.concatenate(out)
