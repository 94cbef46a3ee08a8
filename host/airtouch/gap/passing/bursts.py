"""Gates of bursts and of pushes: intervals in which a vehicle is shaken or pushed far more than in all the rest.

A wake that is flown through lasts shorter than a block, and the spectra of blocks would not show when. Two signals
show it: the force along the thrust, and the yaw torque above the band in which the vehicle is steered. Rotors in a wake
draw an unsteady torque, and commands hardly move the yaw axis that fast. A smooth push shakes nothing: its interval is
the one in which the force is at least half of its peak.
"""

from dataclasses import dataclass

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.filters import both_ways, highpass, lowpass
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.gap.passing.gate_search import (
    ENDS,
    LEAST_BLOCKS,
    MOST_INTERVALS,
    MOST_OF_FLIGHTS,
    best_intervals,
    interval_cost,
)
from airtouch.gap.signals.channels import COLUMN, residual
from airtouch.gap.study import Study
from airtouch.logs.segments import runs
from airtouch.robust import deviation
from airtouch.simulation.effects.effect import Gate


@dataclass(frozen=True)
class BurstSignal:
    """A channel of the residual (a column of `residual`), and its band, Hz, in pieces of so many seconds.

    freedom: independent values in a piece; burst_ratio: power of a burst over the flight's median, chosen. With a
    larger number weaker bursts are no gate, and one needs fewer pieces to gain more than its choice costs.
    """

    column: int
    band_hz: tuple[float, float]
    piece_s: float
    freedom: float
    burst_ratio: float = 6.0


#: band, Hz, in which a vehicle is shaken and hardly steered, and length of its pieces, s. Chosen for the yaw torque
#: among six bands and two lengths, on wakes of recorded flights (host/docs/looks.md, 2026-11-25 20:55), and for all
#: torques and the lift among twelve sets of signals (2026-11-26 22:55). A lower end takes in more of what steers, a
#: longer piece tells a short burst less well
SHAKE_BAND_HZ, SHAKE_PIECE_S = (15.0, 40.0), 0.32
#: band, Hz, piece, s, and freedom have no source: all were chosen. A longer piece tells a short push less well, more
#: freedom gives each piece more nats
FORCE_BURSTS = BurstSignal(COLUMN["force_z"], (1.0, 50.0), 0.16, 3.0)
#: freedom: twice the band's width times the piece's length
YAW_BURSTS = BurstSignal(COLUMN["torque_z"], SHAKE_BAND_HZ, SHAKE_PIECE_S, 16.0)
#: band, Hz, of single pushes, and robust standard deviations of the flight that the strongest has at least; chosen. A
#: lower upper end makes short pushes longer, a smaller number tries more gates of noise
SINGLE_BAND_HZ, SINGLE_OVER = (0.1, 5.0), 5.0
#: pieces in the air, below which no burst is sought and no flight is unsteady; chosen. A larger number says nothing of
#: short flights
LEAST_PIECES = 2 * LEAST_BLOCKS


def burst_gate(data: Data, signal: BurstSignal) -> tuple[Gate, float]:
    """The bursts of a signal in all flights, and nats that their choice costs; none where they fill what counts."""
    gate: list[tuple[str, float, float]] = []
    cost = judged_s = 0.0
    for flight in data.flights:
        gain = _gains(piece_powers(data.study, flight, signal.column, signal.band_hz, signal.piece_s), signal)
        known = int(np.isfinite(gain).sum())
        judged_s += known * signal.piece_s
        if known < LEAST_PIECES:
            continue
        intervals = best_intervals(gain, np.zeros(len(gain), int), interval_cost(known))
        gate += [(flight.name, a * signal.piece_s, (b + 1) * signal.piece_s) for a, b in intervals]
        cost += interval_cost(known) * len(intervals)
    duration_s = sum(end - begin for _, begin, end in gate)
    return ((), 0.0) if duration_s > MOST_OF_FLIGHTS * judged_s else (tuple(gate), cost)


def push_gate(data: Data) -> tuple[Gate, float]:
    """The pushes along the thrust of at least half of the strongest, in all flights, and nats that their choice costs.

    They point the same way, and each lasts as long as it is so strong; MOST_INTERVALS a flight at most. None where the
    strongest is no more than SINGLE_OVER robust standard deviations of the flight.
    """
    gate: list[tuple[str, float, float]] = []
    cost = 0.0
    for flight in data.flights:
        force, counts = residual_in_band(data.study, flight, FORCE_BURSTS.column, SINGLE_BAND_HZ)
        pieces = int(counts.sum() * PERIOD_S / FORCE_BURSTS.piece_s)
        if pieces < LEAST_PIECES:
            continue
        push = np.where(counts, force - np.median(force[counts]), 0.0)
        strongest = push[np.argmax(np.abs(push))]
        if abs(strongest) <= SINGLE_OVER * deviation(push[counts]):
            continue
        relative = push / strongest
        peaks = {run: relative[slice(*run)].max() for run in runs(relative > 0.5)}
        highest = sorted(peaks, key=peaks.__getitem__, reverse=True)[:MOST_INTERVALS]
        gate += [(flight.name, a * PERIOD_S, b * PERIOD_S) for a, b in sorted(highest)]
        cost += interval_cost(pieces) * len(highest)
    return tuple(gate), cost


def residual_in_band(study: Study, flight: Flight, column: int, band_hz: tuple[float, float],
                     ) -> tuple[np.ndarray, np.ndarray]:
    """A column of the residual in a band (n,), and which of its samples count (n,).

    None counts on the ground, at take-off or landing, nor one that bridges lost rows; straight lines lead over them.
    """
    values = residual(flight, study.vehicle, study.calibration)[:, column]
    counts = ~(flight.bridged | np.isin(flight.phase, (GROUND, *ENDS))) & np.isfinite(values)
    low, high = (2.0 * hertz * PERIOD_S for hertz in band_hz)
    out = both_ways(highpass(low), interpolate_missing(np.where(counts, values, np.nan)))
    return (both_ways(lowpass(high), out) if high < 1.0 else out), counts


def piece_powers(study: Study, flight: Flight, column: int, band_hz: tuple[float, float], piece_s: float) -> np.ndarray:
    """Mean square (pieces,) of a column of the residual in a band; 0 in pieces with a sample that does not count."""
    values, counts = residual_in_band(study, flight, column, band_hz)
    size = round(piece_s / PERIOD_S)
    pieces = len(values) // size
    power = (values[:pieces * size].reshape(pieces, size) ** 2).mean(axis=1)
    return np.where(counts[:pieces * size].reshape(pieces, size).all(axis=1), power, 0.0)


def _gains(power: np.ndarray, signal: BurstSignal) -> np.ndarray:
    """Nats (pieces,) that a power `burst_ratio` times the median gains over the median; -inf where it is 0.

    It is the log likelihood ratio of a chi-square of `freedom`. A piece counts as if it were no stronger than that.
    """
    known = power > 0.0
    if not known.any():
        return np.full(len(power), -np.inf)
    over = np.minimum(power / np.median(power[known]), signal.burst_ratio)
    gain = 0.5 * signal.freedom * (over * (1.0 - 1.0 / signal.burst_ratio) - np.log(signal.burst_ratio))
    return np.where(known, gain, -np.inf)
