"""Speeds of the rotors in the air, as logged and as modelled."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airtouch.gap.flights.flight import GROUND, Flight
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.gap.study import Study
from airtouch.logs.flight_log import RPM
from airtouch.simulation import replay

LEAST_RPM = 500.0  #: 1/min from which a rotor is logged to turn; chosen, far below any hover
LEAST_TURNING = 0.5  #: share of the samples in the air above which it must be; chosen
LEAST_MODELLED_RPM = 1.0  #: 1/min by which a logged speed is divided at least; chosen


class RotorSpeed(NamedTuple):
    """Speed of a rotor, 1 to 4, in the air: mean over flights as logged and as modelled, 1/min.

    ratio: of the two, mean over flights, with its least and largest (low, high); flights: how many log it.
    """

    rotor: int
    logged: float
    modelled: float
    ratio: float
    low: float
    high: float
    flights: int

    def in_words(self) -> str:
        """As `rotor 1: 19600 rpm logged, 0.960 of the model's (0.950 to 0.970 over 6 flights)`."""
        return (f"rotor {self.rotor}: {self.logged:.0f} rpm logged, {self.ratio:.3f} of the model's "
                f"({self.low:.3f} to {self.high:.3f} over {self.flights} flights)")


def rotor_speeds(flight: Flight, study: Study) -> np.ndarray | None:
    """Median speed of each rotor in the air as logged and as modelled, (2, 4) 1/min; None without rpm."""
    air = (flight.phase != GROUND) & flight.usable
    if not flight.log.has(*RPM) or not air.any():
        return None
    model = replay.run(flight.log, study.vehicle, study.calibration, signals=flight.signals.copy(),
                       pwm=flight.pwm)
    logged = np.array([interpolate_missing(flight.log[c]) for c in RPM]).T[air]
    turning = (logged > LEAST_RPM).mean(axis=0) > LEAST_TURNING  # else no counter, or it reads nothing
    return np.array([np.where(turning, np.median(logged, axis=0), np.nan),
                     np.median(model.rotor_speed[air], axis=0) * 30.0 / np.pi])


def speeds_over_flights(speeds: Sequence[np.ndarray | None]) -> tuple[RotorSpeed, ...]:
    """Speed of each rotor over the flights.

    speeds: (2, 4) of each flight, see `rotor_speeds`. A rotor that no flight logs is left out.
    """
    out = []
    for rotor in range(4):
        pairs = np.array([s[:, rotor] for s in speeds if s is not None and np.isfinite(s[0, rotor])])
        if len(pairs):
            ratio = pairs[:, 0] / np.maximum(pairs[:, 1], LEAST_MODELLED_RPM)
            logged, modelled = pairs.mean(axis=0)
            out.append(RotorSpeed(rotor + 1, float(logged), float(modelled), float(ratio.mean()), float(ratio.min()),
                                  float(ratio.max()), len(pairs)))
    return tuple(out)
