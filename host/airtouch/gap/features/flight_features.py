"""The features of one flight: some 2,300 numbers that say how its signals go together, without a unit to compare by.

What they say of a vehicle is known by flights of it without any effect: see `feature_space`.
"""

from functools import cache

import numpy as np

from airtouch.gap.features import coherence, edge_steps, moments
from airtouch.gap.features.feature import Feature
from airtouch.gap.features.flight_signals import readable, signals_of
from airtouch.gap.flights.flight import Flight, without_columns
from airtouch.logs.flight_log import RPM
from airtouch.vehicle import Vehicle

UNSEEN = ("vbat_V", *RPM)  #: columns that are left out: few small vehicles log them


@cache
def declared_features() -> tuple[Feature, ...]:
    """All features, in their order."""
    return (*coherence.declared_features(), *moments.declared_features(), *edge_steps.declared_features())


def features(flight: Flight, vehicle: Vehicle) -> np.ndarray | None:
    """Features (len(declared_features()),) of a flight of a vehicle as declared, NaN where there is nothing to tell by.

    None for a log that lacks a column. Takes about 20 ms.
    """
    if flight.rates is None or not readable(flight.log):
        return None
    signals = signals_of(without_columns(flight, vehicle, UNSEEN), vehicle)
    return np.concatenate([coherence.coherence_features(signals), moments.moment_features(signals, vehicle),
                           edge_steps.edge_step_features(signals)])
