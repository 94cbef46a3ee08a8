"""A pass over a platform: its pieces to diagnose, and its spectra as a detector sees them."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.signal import welch

from airtouch import logs
from airtouch.detector.evaluation.data.dataset import FlightFile
from airtouch.detector.shared import channels
from airtouch.logs.flight_log import FlightLog

#: limits of the bands of a spectrum, Hz: about octaves; no other source
BANDS_HZ = (0.7, 2.0, 6.0, 12.0, 25.0, 50.1)
RATE_HZ = 100.0  #: of the logs
WINDOW = 128  #: samples of a block of a spectrum: 1.28 s, as a platform is passed in about 2 s
#: samples around the platform that belong to the pass; chosen by what diagnoses of passes named (host/docs/looks.md,
#: 2026-11-21 15:20)
BEFORE, AFTER = 500, 100
SETTLED = 300  #: samples after the motors start that are left out: the take-off; no source: round number
SHORTEST_FREE, SHORTEST_OVER = 400, 100  #: samples of free air and of platform, at least; no source: round numbers
FREE = slice(-320, -20)  #: samples before an entry whose spectrum is that of free air: 3 s, clear of the edge


def in_still_air(file: FlightFile) -> bool:
    """Whether no fan blew, as far as the manifest knows."""
    return file.condition.wind in (None, "none")


def first_edges(log: FlightLog) -> tuple[int, int]:
    """Samples of the first entry and its exit; zeros where there are none."""
    first, last, *_ = [*(e.sample for e in logs.true_edges(log)), 0, 0]
    return first, last


def pieces(log: FlightLog) -> tuple[FlightLog, FlightLog] | None:
    """(the pass, free air before it): two pieces of one flight; None where one is too short.

    The pass begins well before the platform, so that noise that is there only close to a surface is not taken
    for noise that is always there.
    """
    entry, leave = first_edges(log)
    start = int(np.argmax(logs.airborne(log))) + SETTLED
    if entry - BEFORE - start < SHORTEST_FREE or leave - entry < SHORTEST_OVER:
        return None
    return log.slice(entry - BEFORE, leave + AFTER), log.slice(start, entry - BEFORE)


def spectra(log: FlightLog) -> np.ndarray:
    """dB (2, bands, 9) of the nine channels in the 3 s before an entry and from it to the exit; NaN if short."""
    out = np.full((2, len(BANDS_HZ) - 1, 9), np.nan)
    entry, leave = first_edges(log)
    values = channels.nine_channels(log)
    for k, (a, b) in enumerate(((max(entry + FREE.start, 0), entry + FREE.stop), (entry, leave))):
        if b - a >= WINDOW and np.isfinite(values[a:b]).all():
            f, power = welch(values[a:b], RATE_HZ, nperseg=WINDOW, axis=0)
            for i, (low, high) in enumerate(pairwise(BANDS_HZ)):
                out[k, i] = 10.0 * np.log10(power[(f >= low) & (f < high)].mean(axis=0) + 1e-12)
    return out


def apart_db(simulated: Sequence[FlightLog], real: Sequence[FlightLog]) -> np.ndarray:
    """Mean absolute difference (2,) of two sets' median spectra, dB: before and over the platform."""
    one, two = (np.nanmedian([spectra(log) for log in flights], axis=0) for flights in (simulated, real))
    return np.nanmean(np.abs(one - two), axis=(1, 2))
