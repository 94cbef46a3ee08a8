"""FC-FE: the power of a signal within one frequency band (paper, section 4.2)."""

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.parameters import DEFAULT
from airtouch.reference.finite import hold_finite

BIN_TOLERANCE = 1e-3  #: a bin this close to the band's edge, in bins, is within the band


def band_bins(sample_rate_hz: float, window: int, band_hz: tuple[float, float]) -> tuple[int, int]:
    """First and last DFT bin k with low <= k fs / window <= high, both included.

    Raises AirTouchError for a window of less than four samples and for a band
    that is empty, touches zero frequency or passes half the sample rate.
    """
    if int(window) != window or window < 4:
        raise AirTouchError(f"band power: the window must be at least 4 samples, not {window}")
    if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 0):
        raise AirTouchError(f"band power: the sample rate must be positive, not {sample_rate_hz}")
    low, high = (float(f) * window / sample_rate_hz for f in band_hz)
    if not (np.isfinite(low) and np.isfinite(high)):
        raise AirTouchError(f"band power: the band must be two frequencies, not {band_hz}")
    first, last = int(np.ceil(low - BIN_TOLERANCE)), int(np.floor(high + BIN_TOLERANCE))
    if first < 1 or last > window // 2 or first > last:
        raise AirTouchError(
            f"band power: band {band_hz[0]:g} to {band_hz[1]:g} Hz holds no bin of a {window}-sample window at "
            f"{sample_rate_hz:g} Hz; bins are {sample_rate_hz / window:g} Hz apart, from there to "
            f"{sample_rate_hz / window * (window // 2):g} Hz"
        )
    return first, last


def window_ends(samples: int, window: int = DEFAULT.band_window, hop: int = 1) -> np.ndarray:
    """The last sample of each full window: window - 1, window - 1 + hop, ..."""
    return np.arange(window - 1, samples, hop)


def band_power(
    x: np.ndarray,
    *,
    sample_rate_hz: float = DEFAULT.sample_rate_hz,
    window: int = DEFAULT.band_window,
    band_hz: tuple[float, float] = (DEFAULT.band_low_hz, DEFAULT.band_high_hz),
    hop: int = DEFAULT.band_hop,
) -> np.ndarray:
    """Mean square of each channel within the band, causal, unit of x squared.

    x: (n,) or (n, c). The one-sided power spectral density of the last `window`
    samples, their mean removed and under a periodic Hann window, scaled as
    `scipy.signal.ShortTimeFFT` with scale_to="psd" does and integrated over the
    band's bins (both edges included); a sine of amplitude A amid the band gives A^2 / 2.

    hop 1: (n, c), row i from samples i - window + 1 to i, NaN before the window is
    full. hop > 1: one row a window, ending at `window_ends(n, window, hop)`.
    Non-finite samples: `hold_finite`. Raises AirTouchError as `band_bins` does.
    """
    first, last = band_bins(sample_rate_hz, window, band_hz)
    if int(hop) != hop or hop < 1:
        raise AirTouchError(f"band power: the hop must be at least 1 sample, not {hop}")
    hop = int(hop)
    samples = np.asarray(x, dtype=np.float64)
    if samples.ndim not in (1, 2):
        raise AirTouchError(f"band power: samples must be (n,) or (n, channels), not {samples.shape}")
    clean, _ = hold_finite(samples[:, None] if samples.ndim == 1 else samples)
    ends = window_ends(len(clean), window, hop)
    power = np.zeros((len(ends), clean.shape[1]))
    if len(ends):
        for projection in _windowed_basis(window, first, last).T:
            for channel, values in enumerate(clean.T):
                power[:, channel] += np.square(np.correlate(values, projection, "valid")[::hop])
    if hop == 1:
        power = np.concatenate([np.full((len(clean) - len(ends), clean.shape[1]), np.nan), power])
    return power[:, 0] if samples.ndim == 1 else power


def _windowed_basis(window: int, first: int, last: int) -> np.ndarray:
    """(window, 2 bins): cosines, then sines, such that the squared projections sum to the power."""
    taper = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(window) / window)  # Hann, periodic
    bins = np.arange(first, last + 1)
    sides = np.where(2 * bins == window, 1.0, 2.0)
    scale = np.sqrt(sides / (window * np.square(taper).sum()))
    phase = 2 * np.pi * (np.outer(np.arange(window), bins) % window) / window
    basis = np.hstack([np.cos(phase), np.sin(phase)]) * taper[:, None] * np.tile(scale, 2)
    return basis - basis.mean(axis=0)
