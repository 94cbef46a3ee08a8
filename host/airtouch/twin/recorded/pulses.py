"""Periodic velocity pulses that a script sends while the drone hovers, detected in the motor commands.

The authors' program sent one of about 20 ms every 0.52 s in hover: a step of the pitch command and 20 deg/s of
pitch rate. Without them a simulated hover is calmer than the recorded one, in the channels that show an edge.
"""

from functools import lru_cache

import numpy as np

from airtouch.logs.flight_log import PWM, FlightLog
from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.reference.finite import hold_finite
from airtouch.robust import deviation
from airtouch.twin.recorded.channels import ROTOR_SIGNS

PERIODS_S = np.arange(0.30, 1.0, 0.002)  #: s, periods that are tried; the authors' is 0.52 s
MIN_PULSES = 4  #: periods that a hover must hold; no source: least for a scatter
#: standard errors of the mean jump; of the authors' flights (folds 0 to 2) those with pulses have 7.5 or more, all at
#: 0.52 s, the others 6.5 or less
THRESHOLD = 7.0
TABLE = 2000  #: samples by which the table of phases grows; chosen: a hover of 20 s, 0.7 MB
CLIP = 10.0  #: robust standard deviations, to which larger jumps (set-point steps) are clipped; no source: round number


def period(log: FlightLog, start: int, stop: int) -> float:
    """Period in s of the pulses between two samples of a 100 Hz log; 0 without pulses."""
    if stop - start < MIN_PULSES * PERIODS_S[0] * SAMPLE_RATE_HZ:
        return 0.0
    jumps = np.diff(hold_finite(log.stack(PWM)[start:stop])[0] @ np.array(ROTOR_SIGNS["pitch"], dtype=float))
    size = deviation(jumps)
    if size <= 0.0:
        return 0.0
    jumps = np.clip(jumps / size, -CLIP, CLIP)
    scatter, best, best_s = jumps.std(), THRESHOLD, 0.0
    for seconds, phases in zip(PERIODS_S, _phases(TABLE * -(-len(jumps) // TABLE)), strict=True):
        samples = seconds * SAMPLE_RATE_HZ
        if len(jumps) < MIN_PULSES * samples:
            break
        phase = phases[:len(jumps)]
        mean = np.bincount(phase, jumps)[:int(samples)] / np.bincount(phase)[:int(samples)]
        score = np.abs(mean).max() * np.sqrt(len(jumps) / samples) / scatter
        if score > best:
            best, best_s = score, float(seconds)
    return round(best_s, 3)


@lru_cache(maxsize=2)
def _phases(length: int) -> np.ndarray:
    """Phase (periods, samples) of each sample in each of PERIODS_S, in whole samples."""
    sample = np.arange(length)
    return np.array([(sample % (seconds * SAMPLE_RATE_HZ)).astype(np.uint8) for seconds in PERIODS_S])
