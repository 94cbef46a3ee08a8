"""Bursts: stretches in which the force along the thrust is far livelier than in the rest of the flight.

A wake that is flown through lasts shorter than a block, and the spectra of blocks would not show when.
"""

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.filters import both_ways, highpass
from airtouch.gap.flights.flight import PERIOD_S, Flight
from airtouch.gap.passing.stretches import ENDS, LEAST_BLOCKS, WHOLE, best_stretches, price_of_stretches
from airtouch.gap.signals.channels import residual
from airtouch.gap.signals.study import Study
from airtouch.simulation.effects.effect import Gate

#: no number here has a source: all were chosen
PIECE_S = 0.16  #: s, length of the pieces of the force along the thrust in which bursts are sought
LIVELY_HZ = 1.0  #: frequency above which a burst shows
LIVELY = 6.0  #: power of a burst over the flight's median
DEGREES = 3.0  #: independent values in a piece
LEAST_PIECES = 2 * LEAST_BLOCKS  #: pieces in the air, below which no burst is sought


def bursts(data: Data) -> tuple[Gate, float]:
    """The bursts of all flights, and nats that their choice costs; none where they are all of the flights' time."""
    gate: list[tuple[str, float, float]] = []
    price = 0.0
    for flight in data.flights:
        gain = _gains(_pieces(data.study, flight))
        known = int(np.isfinite(gain).sum())
        if known < LEAST_PIECES:
            continue
        stretches = best_stretches(gain, np.zeros(len(gain), int), price_of_stretches(known))
        gate += [(flight.name, a * PIECE_S, (b + 1) * PIECE_S) for a, b in stretches]
        price += price_of_stretches(known) * len(stretches)
    seconds = sum(end - begin for _, begin, end in gate)
    whole = seconds > WHOLE * data.seconds
    return ((), 0.0) if whole else (tuple(gate), price)


def thrust_residual(study: Study, flight: Flight) -> tuple[np.ndarray, np.ndarray]:
    """Residual (n,) of the force along the thrust, m/s^2, 0 where it does not count, and where it counts (n,).

    It does not on the ground, in bridged samples, at take-off and landing.
    """
    counts = ~(flight.on_ground | flight.bridged | np.isin(flight.phase, ENDS))
    return np.where(counts, np.nan_to_num(residual(flight, study.vehicle, study.calibration)[:, 2]), 0.0), counts


def _pieces(study: Study, flight: Flight) -> np.ndarray:
    """Mean square (pieces,) of the force along the thrust above LIVELY_HZ, m^2/s^4; 0 where it is not known."""
    force, _ = thrust_residual(study, flight)
    size = int(PIECE_S / PERIOD_S)
    fast = both_ways(highpass(LIVELY_HZ * 2.0 * PERIOD_S), force)
    return (fast[:len(force) // size * size].reshape(-1, size) ** 2).mean(axis=1)


def _gains(power: np.ndarray) -> np.ndarray:
    """Nats (pieces,) that a power LIVELY times the median gains over the median; -inf where it is 0.

    It is the log likelihood ratio of a chi-square of DEGREES. A piece counts as if it were no livelier than LIVELY.
    """
    known = power > 0.0
    if not known.any():
        return np.full(len(power), -np.inf)
    over = np.minimum(power / np.median(power[known]), LIVELY)
    return np.where(known, 0.5 * DEGREES * (over * (1.0 - 1.0 / LIVELY) - np.log(LIVELY)), -np.inf)
