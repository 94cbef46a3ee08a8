"""Short-time spectra of the gap: blocks of a flight, their spectra, which bins count.

Blocks of 2.56 s (0.24 s on the ground) under a Hann window, half overlapping (Welch 1967). A bin's value over the
square root of the floor's power (`floor`) is a complex normal number of power 1 in a nominal flight.
"""

import numpy as np

from airtouch.gap.flights.blocks import count_within, half_overlapping, hann_window
from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.signals.channels import CHANNELS, COLUMN, COUNT

# Blocks. A sample has a phase (`flights.flight`), of which GROUND is one; a block has a state. It is at REST where the
# phase is GROUND throughout and the motors are off, in the AIR where the phase is never GROUND; others are not taken.
AIR, REST = "air", "ground"  #: states of the vehicle throughout a block: in the air, at rest on the ground
LENGTH = {AIR: 256, REST: 24}  #: samples of a block, 2.56 s and 0.24 s; chosen
OVERLAP_WEIGHT = 0.5  #: of a block in a sum of log likelihoods, as half overlapping blocks hold every sample twice
MOST_LOST = 0.1  #: share of a block's samples that may be bridged; chosen

# Power over frequency, here and in the folders that use it.
SMOOTH = 1.5  #: bins, standard deviation of the Gaussian that averages floors and laws over frequency; chosen
#: bins, frequency at which a spectrum that falls to 0 is taken in its lowest bin, as the window leaks into it; chosen
LEAKED = 0.5
LEAST_POWER = 1e-300  #: least power that is divided by or has a logarithm; below any measured


def starts(flight: Flight, state: str) -> np.ndarray:
    """First samples of the blocks in a state, AIR or REST, of usable samples, at most MOST_LOST of them bridged."""
    length = LENGTH[state]
    good = flight.on_ground if state == REST else flight.phase != GROUND
    near = good & (flight.usable | flight.bridged)
    may_begin = (count_within(~near, length) == 0) & (count_within(flight.bridged, length) <= MOST_LOST * length)
    return half_overlapping(may_begin, length)


def frequencies(state: str) -> np.ndarray:
    """Frequencies (bins,) of the blocks in a state, Hz."""
    return np.fft.rfftfreq(LENGTH[state], PERIOD_S)


def short_time_spectra(values: np.ndarray, first: np.ndarray, state: str) -> np.ndarray:
    """Spectra (blocks, bins, channels) of values (n, channels) in blocks from samples `first`, unit/sqrt(Hz).

    The mean of |.|^2 is the one-sided PSD; a constant x gives x * sqrt(duration / 1.5) in the lowest bin.
    """
    length = LENGTH[state]
    if not len(first):
        return np.zeros((0, length // 2 + 1, values.shape[1]), complex)
    window, scale = hann_window(length)
    cut = values[first[:, None] + np.arange(length)]
    cut *= window
    spectrum = np.fft.rfft(cut, axis=1)
    spectrum *= scale
    spectrum[:, 0] /= np.sqrt(2.0)
    if length % 2 == 0:
        spectrum[:, -1] /= np.sqrt(2.0)
    return spectrum


def squared(values: np.ndarray) -> np.ndarray:
    """|values|^2 of complex values; the root that `abs` takes costs five times as much."""
    return values.real ** 2 + values.imag ** 2


def judged_bins(state: str) -> np.ndarray:
    """Which bins of each channel count, bool (bins, COUNT): those in its band; on the ground of force and rate alone.

    In the air the yaw rate says nothing of the gyro: a vehicle that trusts a biased gyro turns slowly.
    """
    f = frequencies(state)[:, None]
    in_band = np.array([[c.low_hz <= x <= c.high_hz for c in CHANNELS] for x in f[:, 0]])
    if state == REST:
        force_or_rate = np.array([c.name.startswith(("force", "rate")) for c in CHANNELS])
        return np.broadcast_to(force_or_rate, (len(f), COUNT)).copy()
    in_band[:, COLUMN["rate_z"]] = False
    return in_band


def difference_power(f: np.ndarray) -> np.ndarray:
    """PSD (bins,) of the differences between samples of white noise over its own, at frequencies f (bins,), Hz."""
    return 4.0 * np.sin(np.pi * f * PERIOD_S) ** 2
