"""Ten million samples later the sliding DFT is as exact as at first."""

import numpy as np
from scipy.signal import ShortTimeFFT
from scipy.signal.windows import hann

from airtouch.kernels import BandPowerBank

SAMPLES, PIECE, WINDOW = 10_000_000, 1_000_000, 200


def scipy_last_window(x):
    """Band power 6 to 8 Hz of the last 200 samples of x (n, c) by ShortTimeFFT's spectral density."""
    stft = ShortTimeFFT(hann(WINDOW, sym=False), hop=1, fs=100.0, scale_to="psd")
    last = len(x) - WINDOW // 2  # the slice whose window ends at the last sample
    spectrum = stft.stft(x.T.astype(np.float64), p0=last, p1=last + 1)[..., 0]
    within = (stft.f > 5.99) & (stft.f < 8.01)
    return 2 * np.square(np.abs(spectrum[:, within])).sum(axis=1) * 100.0 / WINDOW


def test_no_drift_after_ten_million_samples():
    """Three channels: hover-like noise on gravity, PWM differences with bursts, a ramp that never ends."""
    rng = np.random.default_rng(0)
    bank = BandPowerBank(3, 100.0, WINDOW, (6.0, 8.0), WINDOW)
    errors = []
    for piece in range(SAMPLES // PIECE):
        x = rng.standard_normal((PIECE, 3), dtype=np.float32)
        x[:, 0] = x[:, 0] * np.float32(0.05) + np.float32(9.81)
        x[:, 1] *= 300
        x[::997, 1] += 15000
        x[:, 2] += np.float32(1e-3) * np.arange(piece * PIECE, (piece + 1) * PIECE, dtype=np.float32)
        power = bank.push(x)
        errors.append(np.abs(power[-1] / scipy_last_window(x[-400:]) - 1))
    errors = np.array(errors)
    print(f"\nband power against SciPy after 1e6 and 1e7 samples: relative error {errors[0].max():.1e}, "
          f"{errors[-1].max():.1e}; the worst of every millionth {errors.max():.1e}")
    assert errors.max() <= 1e-5
    assert errors[-1].max() <= 10 * np.median(errors) + 1e-6
