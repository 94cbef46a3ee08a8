"""FC-FE in C: see `airtouch.reference.band_power`, whose shapes, units and errors these share."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.arrays import float32, pointer
from airtouch.kernels.library import ffi, lib
from airtouch.parameters import DEFAULT
from airtouch.reference import band_bins, window_ends


class BandPowerBank:
    """The sliding DFT bank of a stream that comes in pieces; state survives between calls."""

    def __init__(self, channels: int, sample_rate_hz: float, window: int, band_hz: tuple[float, float],
                 hop: int) -> None:
        band_bins(sample_rate_hz, window, band_hz)
        if int(hop) != hop or hop < 1:
            raise AirTouchError(f"band power: the hop must be at least 1 sample, not {hop}")
        self.channels = channels
        self._settings = (float(sample_rate_hz), int(window), float(band_hz[0]), float(band_hz[1]), int(hop))
        floats = lib.bandPowerWork(*self._settings[:4], channels)
        self._work = np.zeros(max(floats, 1), dtype=np.float32)
        self._state = ffi.new("char[]", lib.bandPowerStateSize())
        if not self._run(np.empty((0, channels), np.float32), reset=True)[1]:
            raise AirTouchError(f"band power: the kernel takes windows of 4 to 16384 samples and hops to 65535, "
                                f"not {window} and {hop}")

    def push(self, x: np.ndarray) -> np.ndarray:
        """Powers, one row an output, float32, of the next samples (n, channels). Raises AirTouchError for others."""
        samples = float32(x)
        if samples.ndim != 2 or samples.shape[1] != self.channels:
            raise AirTouchError(f"band power: samples must be (n, {self.channels}), not {samples.shape}")
        return self._run(samples, reset=False)[0]

    def _run(self, x: np.ndarray, reset: bool) -> tuple[np.ndarray, bool]:
        """Powers, and whether the kernel takes these settings."""
        rate, window, low, high, hop = self._settings
        out = np.empty((len(x) // hop + 1, self.channels), dtype=np.float32)
        rows = lib.bandPowerBatch(pointer(x), len(x), self.channels, rate, window, low, high, hop, self._state,
                                  pointer(self._work), self._work.size, reset, pointer(out))
        return out[:max(rows, 0)], rows >= 0


def band_power(
    x: np.ndarray,
    *,
    sample_rate_hz: float = DEFAULT.sample_rate_hz,
    window: int = DEFAULT.band_window,
    band_hz: tuple[float, float] = (DEFAULT.band_low_hz, DEFAULT.band_high_hz),
    hop: int = DEFAULT.band_hop,
) -> np.ndarray:
    """Mean square of each channel within the band, float32, as `reference.band_power`."""
    samples = float32(x)
    if samples.ndim not in (1, 2):
        raise AirTouchError(f"band power: samples must be (n,) or (n, channels), not {samples.shape}")
    table = samples[:, None] if samples.ndim == 1 else samples
    power = BandPowerBank(table.shape[1], sample_rate_hz, window, band_hz, hop).push(table)
    if hop == 1:
        before = len(table) - len(window_ends(len(table), window))
        power = np.concatenate([np.full((before, table.shape[1]), np.nan, np.float32), power])
    return power[:, 0] if samples.ndim == 1 else power
