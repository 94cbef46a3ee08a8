"""Spectra of the logged commands, block by block, in level flight."""

from functools import cache

import numpy as np

from airtouch.gap.flights.filters import both_ways, lowpass
from airtouch.gap.flights.flight import PERIOD_S, Flight
from airtouch.gap.loop.controller import AXES
from airtouch.logs.segments import KINDS
from airtouch.vehicle import Vehicle

LENGTH = 128  #: samples of a block
BAND_HZ = (1.5, 40.0)  #: below it set-points, which no log holds, move the commands
HIGHPASS_HZ = 0.6
MIX = 0.25 * np.array([[1, 1, 1, 1], [-1, -1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1]], dtype=np.float64)
EDGE_S = (0.1, 0.4)  #: excluded before and after a change of phase at an edge, take-off or landing
PLATFORM = KINDS.index("over platform")
START_S = (0.8, 0.2)  #: the same around hover's end and beginning: set-points step before the speed shows it
STEADY = (KINDS.index("hover"), KINDS.index("cruise"), PLATFORM)
FINE, REACH = 4, 2  #: points a bin, bins a window's leakage is followed
FREEDOM = 20.0  #: of the tails of a block's power
STEPPED = 5.0  #: times the median power of its flight's blocks, above which a set-point stepped in a block
SHAPES = 5  #: smooth shapes by which the floor's logarithm may differ from flight to flight
SPREAD = (0.10, 0.04)  #: their standard deviation: level, other shapes (nepers of power)


@cache
def frequencies() -> np.ndarray:
    """Hz of the bins that are judged; not to be changed."""
    return _constant(_all_frequencies()[_judged()])


@cache
def fine_frequencies() -> np.ndarray:
    """FINE points a bin, REACH bins beyond first and last: what a block's window mixes. Not to be changed."""
    f = frequencies()
    step = (f[1] - f[0]) / FINE
    return _constant(f[0] + step * np.arange(-REACH * FINE, (len(f) - 1 + REACH) * FINE + 1))


def through_window(power: np.ndarray) -> np.ndarray:
    """PSD (..., fine points) as blocks under a Hann window show it, (..., bins)."""
    kernel = _window()
    count = (power.shape[-1] - 1) // FINE + 1 - 2 * REACH
    place = np.arange(count)[:, None] * FINE + np.arange(len(kernel))
    return power[..., place] @ kernel


@cache
def _window() -> np.ndarray:
    """Weights of the points around a bin in its power under a Hann window, (2 REACH FINE + 1,)."""
    x = np.arange(-REACH * FINE, REACH * FINE + 1) / FINE
    kernel = (0.5 * np.sinc(x) + 0.25 * (np.sinc(x - 1.0) + np.sinc(x + 1.0))) ** 2
    return _constant(kernel / kernel.sum())


def _constant(values: np.ndarray) -> np.ndarray:
    values.flags.writeable = False
    return values


def _all_frequencies() -> np.ndarray:
    return np.fft.rfftfreq(LENGTH, PERIOD_S)


def _judged() -> np.ndarray:
    return (_all_frequencies() >= BAND_HZ[0]) & (_all_frequencies() <= BAND_HZ[1])


def highpassed(values: np.ndarray) -> np.ndarray:
    """Values (n,) or (n, c) without what changes slower than HIGHPASS_HZ."""
    low = lowpass(HIGHPASS_HZ * 2.0 * PERIOD_S)
    return values - both_ways(low, values, min(60, len(values) - 2))


def commands(flight: Flight, vehicle: Vehicle) -> np.ndarray:
    """Collective, roll, pitch and yaw commands (n, 4), N per motor, above HIGHPASS_HZ."""
    return flight.workspace.once("commands", vehicle, lambda: highpassed(vehicle.thrust(flight.pwm) @ MIX.T))


def steady(flight: Flight) -> np.ndarray:
    """Samples (n,) of level flight away from edges, take-off and landing."""
    level = np.isin(flight.phase, STEADY) & (flight.usable | flight.bridged)
    over = np.where(np.isin(flight.phase, STEADY), flight.phase == PLATFORM, 2)
    moving = np.where(flight.phase == KINDS.index("hover"), 0, 1)
    for change, span in ((np.diff(over), EDGE_S), (np.diff(moving), START_S)):
        before, after = (int(x / PERIOD_S) for x in span)
        for k in np.flatnonzero(change) + 1:
            level[max(k - before, 0):k + after] = False
    return level


def starts(flight: Flight) -> np.ndarray:
    """First samples of the blocks, half overlapping."""
    bad = np.cumsum(np.concatenate([[0], ~steady(flight)]))
    out, k = [], 0
    while k + LENGTH <= len(flight):
        if bad[k + LENGTH] == bad[k]:
            out.append(k)
            k += LENGTH // 2
        else:
            k += 1
    return np.array(out, int)


def block_spectra(flight: Flight, vehicle: Vehicle) -> tuple[np.ndarray, np.ndarray]:
    """First samples and spectra (blocks, bins, AXES) of the commands, N/sqrt(Hz)."""
    return flight.workspace.once("command spectra", vehicle, lambda: _block_spectra(flight, vehicle))


def _block_spectra(flight: Flight, vehicle: Vehicle) -> tuple[np.ndarray, np.ndarray]:
    first = starts(flight)
    window = np.hanning(LENGTH + 1)[:-1]
    scale = np.sqrt(2.0 * PERIOD_S / (window ** 2).sum())
    logged = commands(flight, vehicle)[:, :len(AXES)]
    cut = logged[first[:, None] + np.arange(LENGTH)] if len(first) else np.zeros((0, LENGTH, len(AXES)))
    spectra = np.fft.rfft(cut * window[:, None], axis=1)[:, _judged()] * scale
    calm = _calm(np.abs(spectra) ** 2)
    return first[calm], spectra[calm]


def _calm(power: np.ndarray) -> np.ndarray:
    """Blocks (bool) of power (blocks, bins, AXES) like the flight's others: in the rest a set-point stepped."""
    if len(power) < 3:
        return np.ones(len(power), bool)
    typical_power = np.median(power, axis=0) / np.log(2.0)
    return ((power / np.maximum(typical_power, 1e-30)).mean(axis=1) < STEPPED).all(axis=1)


def typical(power: np.ndarray) -> np.ndarray:
    """Power (bins, AXES) of highest likelihood for that of blocks (blocks, bins, AXES), tails as CommandView has them.

    The mean would follow the few blocks in which a set-point stepped.
    """
    estimate = power.mean(axis=0)
    for _ in range(12):
        e = power / estimate
        estimate = estimate * ((FREEDOM + 1.0) * e / (FREEDOM + e)).mean(axis=0)
    return estimate


def shapes() -> np.ndarray:
    """Smooth shapes (SHAPES, bins) over the logarithm of frequency: level, slope, slow waves."""
    x = np.log(frequencies())
    x = (x - x[0]) / (x[-1] - x[0])
    return np.array([np.cos(np.pi * k * x) for k in range(SHAPES)])
