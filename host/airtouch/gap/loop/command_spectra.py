"""Spectra of the logged commands, block by block, in level flight, and how blocks show a modelled spectrum.

The power e of a value of a block where p is expected has the log likelihood

    -log p - (nu + 1) log(1 + e / (nu p))            Student-like tails of nu = COMMAND_FREEDOM degrees of freedom

(`log_likelihood`): e / p follows the F distribution of 2 and 2 nu degrees of freedom. The slope by log p is
`counted_power` of e / p, less 1.
"""

from functools import cache

import numpy as np
from numba import float64, njit
from numba.extending import register_jitable

from airtouch.gap.flights.blocks import count_within, half_overlapping, hann_window
from airtouch.gap.flights.filters import both_ways, lowpass
from airtouch.gap.flights.flight import PERIOD_S, Flight
from airtouch.gap.loop.controller import AXES
from airtouch.logs.segments import KINDS
from airtouch.vehicle import Vehicle

COMMAND_LENGTH = 128  #: samples of a block, 1.28 s; chosen
BAND_HZ = (1.5, 40.0)  #: below it set-points, which no log holds, move the commands; chosen
HIGHPASS_HZ = 0.6  #: below it the commands are filtered out before blocks are cut; chosen
PADDING = 60  #: samples that the filter mirrors at each end of a flight; chosen
#: collective, roll, pitch and yaw, N per motor, from the thrust of each motor: motors as the Crazyflie counts them
MIX = 0.25 * np.array([[1, 1, 1, 1], [-1, -1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1]], dtype=np.float64)
EDGE_S = (0.1, 0.4)  #: s excluded before and after a change of phase at an edge, take-off or landing; chosen
PLATFORM = KINDS.index("over platform")
#: s excluded before and after hover's end and beginning, as set-points step before the speed shows it; chosen
START_S = (0.8, 0.2)
STEADY = (KINDS.index("hover"), KINDS.index("cruise"), PLATFORM)
FINE, REACH = 4, 2  #: points a bin; bins that a window's leakage is followed, its main lobe; chosen
COMMAND_FREEDOM = 20.0  #: degrees of freedom of the Student-like tails of a block's power; chosen
#: power of a block's commands over the median of its flight's blocks, above which a set-point stepped in it; chosen
STEPPED_COMMAND = 5.0
FEWEST_TO_COMPARE = 3  #: blocks of a flight of which one can be unlike the others
VANISHING_POWER = 1e-30  #: least power, in any unit, that is divided by or has a logarithm; far below any measured
ITERATIONS = 12  #: iterations to the power of highest likelihood; chosen


def block_spectra(flight: Flight, vehicle: Vehicle) -> tuple[np.ndarray, np.ndarray]:
    """First samples and spectra (blocks, bins, AXES) of the commands, N/sqrt(Hz)."""
    return flight.workspace.cached("command spectra", vehicle, lambda: _block_spectra(flight, vehicle))


def _block_spectra(flight: Flight, vehicle: Vehicle) -> tuple[np.ndarray, np.ndarray]:
    """`block_spectra`, worked out."""
    first = steady_starts(flight)
    window, scale = hann_window(COMMAND_LENGTH)
    logged = commands(flight, vehicle)[:, :len(AXES)]
    cut = logged[first[:, None] + np.arange(COMMAND_LENGTH)] if len(first) else np.zeros((0, COMMAND_LENGTH, len(AXES)))
    spectra = np.fft.rfft(cut * window, axis=1)[:, _judged()] * scale
    level = _without_step(np.abs(spectra) ** 2)
    return first[level], spectra[level]


def commands(flight: Flight, vehicle: Vehicle) -> np.ndarray:
    """Collective, roll, pitch and yaw commands (n, 4), N per motor, above HIGHPASS_HZ."""
    return flight.workspace.cached("commands", vehicle, lambda: highpassed(vehicle.thrust(flight.pwm) @ MIX.T))


def highpassed(values: np.ndarray) -> np.ndarray:
    """Values (n,) or (n, c) without what changes slower than HIGHPASS_HZ."""
    low = lowpass(HIGHPASS_HZ * 2.0 * PERIOD_S)
    return values - both_ways(low, values, min(PADDING, len(values) - 2))


def steady_starts(flight: Flight) -> np.ndarray:
    """First samples of the blocks, half overlapping."""
    return half_overlapping(count_within(~steady(flight), COMMAND_LENGTH) == 0, COMMAND_LENGTH)


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


def _without_step(power: np.ndarray) -> np.ndarray:
    """Blocks (bool) of power (blocks, bins, AXES) like the flight's others: in the rest a set-point stepped."""
    if len(power) < FEWEST_TO_COMPARE:
        return np.ones(len(power), bool)
    mean = np.median(power, axis=0) / np.log(2.0)  # of an exponential law, as that of a bin's power
    return ((power / np.maximum(mean, VANISHING_POWER)).mean(axis=1) < STEPPED_COMMAND).all(axis=1)


def typical(power: np.ndarray) -> np.ndarray:
    """Power (bins, AXES) of highest likelihood for that of blocks (blocks, bins, AXES), with Student-like tails.

    Fixed point of the likelihood's slope. The mean would follow the few blocks in which a set-point stepped.
    """
    estimate = power.mean(axis=0)
    for _ in range(ITERATIONS):
        estimate = estimate * counted_power(power / estimate).mean(axis=0)
    return estimate


def log_likelihood(power: np.ndarray, expected: np.ndarray) -> float:
    """Log likelihood of the power (blocks, bins, AXES) of all values, each counted in full; expected (bins, AXES)."""
    tails = (COMMAND_FREEDOM + 1.0) * np.log1p(power / (expected * COMMAND_FREEDOM))
    return -float((np.log(expected) + tails).sum())


@register_jitable
def counted_power(e):
    """What a power e, over the expected one, counts towards the likeliest power: up to COMMAND_FREEDOM + 1."""
    return (COMMAND_FREEDOM + 1.0) * e / (COMMAND_FREEDOM + e)


@njit(float64[:, ::1](float64[:, :, ::1], float64[:, ::1]), cache=True, error_model="numpy")
def log_likelihood_slope(over, factor):
    """Slope (bins, AXES) of `log_likelihood` by the logarithm of the expected power.

    over (blocks, bins, AXES): power over some expected power; factor (bins, AXES): that power over the expected one.
    """
    out = np.zeros(factor.shape)
    for block in over:
        for b in range(out.shape[0]):
            for a in range(out.shape[1]):
                out[b, a] += counted_power(block[b, a] * factor[b, a]) - 1.0
    return out


@cache
def command_frequencies() -> np.ndarray:
    """Hz of the bins that are judged; not to be changed."""
    return _constant(_all_frequencies()[_judged()])


def _all_frequencies() -> np.ndarray:
    """Frequencies (COMMAND_LENGTH / 2 + 1,) of a block, Hz."""
    return np.fft.rfftfreq(COMMAND_LENGTH, PERIOD_S)


def _judged() -> np.ndarray:
    """Which of them are in BAND_HZ, bool."""
    return (_all_frequencies() >= BAND_HZ[0]) & (_all_frequencies() <= BAND_HZ[1])


@cache
def fine_frequencies() -> np.ndarray:
    """FINE points a bin, REACH bins beyond first and last: what a block's window mixes. Not to be changed."""
    f = command_frequencies()
    step = (f[1] - f[0]) / FINE
    return _constant(f[0] + step * np.arange(-REACH * FINE, (len(f) - 1 + REACH) * FINE + 1))


def through_window(power: np.ndarray) -> np.ndarray:
    """PSD (..., fine points) as blocks under a Hann window show it, (..., bins)."""
    kernel = _leakage()
    count = (power.shape[-1] - 1) // FINE + 1 - 2 * REACH
    place = np.arange(count)[:, None] * FINE + np.arange(len(kernel))
    return power[..., place] @ kernel


@cache
def _leakage() -> np.ndarray:
    """Weights of the points around a bin in its power under a Hann window, (2 REACH FINE + 1,)."""
    x = np.arange(-REACH * FINE, REACH * FINE + 1) / FINE
    kernel = (0.5 * np.sinc(x) + 0.25 * (np.sinc(x - 1.0) + np.sinc(x + 1.0))) ** 2
    return _constant(kernel / kernel.sum())


def _constant(values: np.ndarray) -> np.ndarray:
    """The values, which nobody can write to any more."""
    values.flags.writeable = False
    return values
