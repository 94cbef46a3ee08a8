"""The bands of the map: a power-complementary filter bank, and what the sensors' noise has in each band.

Neighbours cross over by a raised cosine, so that the bands' mean squares add up to that of the signal. A stretch is
mirrored at its ends, so that one of half a second has a value in every band.
"""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.signals.channels import COUNT, FORCE, RATE, TORQUE
from airtouch.gap.signals.spectra import difference_power
from airtouch.simulation.flight import prepare
from airtouch.vehicle import Vehicle

#: edges of the map's bands, Hz: about octaves, chosen; the last ends at half the 100 Hz of the flights. Spectra are
#: judged in `flights.blocks.BANDS_HZ`, which says why its lowest edge is another
MAP_BANDS_HZ = ((0.0, 0.5), (0.5, 2.0), (2.0, 6.0), (6.0, 12.0), (12.0, 25.0), (25.0, 50.0))
CROSSOVER = 0.3  #: half the width of a crossover between two bands, as a fraction of its frequency; chosen
NOISE_FREQUENCIES = 2000  #: at which the gain of a band is averaged for the sensors' noise; chosen


def gains(f: np.ndarray) -> np.ndarray:
    """Amplitude gain (bands, len(f)) of each band at frequencies f, Hz; the squares of all bands add up to 1."""
    lowpass = [np.zeros(len(f))]
    for _, edge in MAP_BANDS_HZ[:-1]:
        position = np.clip((f - edge) / (2.0 * CROSSOVER * edge) + 0.5, 0.0, 1.0)
        lowpass.append(np.cos(0.5 * np.pi * position) ** 2)
    lowpass.append(np.ones(len(f)))
    return np.sqrt(np.maximum(np.diff(lowpass, axis=0), 0.0))


def filtered(values: np.ndarray) -> np.ndarray:
    """Values (n, c) of one stretch in each band, (bands, n, c); a constant stays in the lowest."""
    return _with_gains(values, gains(_mirrored_frequencies(len(values))))


def band_passed(values: np.ndarray, bands: Sequence[int]) -> np.ndarray:
    """Values (n, c) of one stretch in several bands together, with a gain of 1 at a crossover between two of them."""
    power_gain = (gains(_mirrored_frequencies(len(values)))[list(bands)] ** 2).sum(axis=0)
    return _with_gains(values, np.sqrt(power_gain)[None])[0]


def _mirrored_frequencies(n: int) -> np.ndarray:
    """Frequencies (n + 1,), Hz, of a stretch of n samples with its mirror image behind it."""
    return np.fft.rfftfreq(2 * n, PERIOD_S)


def _with_gains(values: np.ndarray, gain: np.ndarray) -> np.ndarray:
    """Values (n, c) with each of several amplitude gains (g, n + 1), (g, n, c); the stretch is mirrored at its end."""
    n = len(values)
    spectrum = np.fft.rfft(np.concatenate([values, values[::-1]]), axis=0)
    return np.fft.irfft(spectrum * gain[:, :, None], 2 * n, axis=1)[:, :n]


def sensor_rms(vehicle: Vehicle) -> np.ndarray:
    """Rms (bands, COUNT) that the declared sensor noise alone has in each band; 0 for commands.

    White noise is averaged over NOISE_FREQUENCIES up to half the sampling rate; torque is its difference quotient.
    """
    row = prepare(vehicle, ())[0][0]
    f = (np.arange(NOISE_FREQUENCIES) + 0.5) * (0.5 / NOISE_FREQUENCIES) / PERIOD_S
    gain = gains(f) ** 2
    white = gain.mean(axis=1)
    differenced = (gain * difference_power(f)).mean(axis=1) / PERIOD_S ** 2
    out = np.zeros((len(MAP_BANDS_HZ), COUNT))
    out[:, FORCE] = white[:, None] * np.asarray(row["acc_noise"]) ** 2
    out[:, TORQUE] = differenced[:, None] * np.asarray(row["gyro_noise"]) ** 2
    out[:, RATE] = white[:, None] * np.asarray(row["gyro_noise"]) ** 2
    return np.sqrt(out)
