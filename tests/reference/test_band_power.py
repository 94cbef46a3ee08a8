"""Band power against SciPy and closed forms."""

import numpy as np
import pytest
from scipy.signal import ShortTimeFFT
from scipy.signal.windows import hann

from airtouch.errors import AirTouchError
from airtouch.reference import band_bins, band_power, window_ends


def scipy_band_power(x, fs, window, band):
    """The integral of ShortTimeFFT's spectral density over the band, and the last sample of each full window."""
    stft = ShortTimeFFT(hann(window, sym=False), hop=1, fs=fs, scale_to="psd")
    slices = np.arange(stft.p_min, stft.p_max(len(x)))
    ends = slices + window - 1 - window // 2
    full = (ends >= window - 1) & (ends < len(x))
    within = (stft.f >= band[0] - 1e-9) & (stft.f <= band[1] + 1e-9)
    sides = np.where(np.isclose(stft.f, fs / 2), 1.0, 2.0)[within, None]
    density = sides * np.abs(stft.stft(x)[within]) ** 2
    return ends[full], density[:, full].sum(axis=0) * fs / window


@pytest.mark.parametrize("fs, window, band", [
    (100.0, 200, (6.0, 8.0)), (100.0, 128, (0.0 + 100 / 64, 50.0)), (50.0, 37, (6.0, 8.0)),
    (1000.0, 64, (100.0, 300.0)),
])
def test_is_the_integral_of_scipys_spectral_density(fs, window, band):
    x = np.random.default_rng(0).normal(size=1000) + np.sin(np.arange(1000) * 0.4)
    ends, expected = scipy_band_power(x, fs, window, band)
    ours = band_power(x, sample_rate_hz=fs, window=window, band_hz=band)
    assert np.isnan(ours[:window - 1]).all() and len(ours) == len(x)
    np.testing.assert_allclose(ours[ends], expected, rtol=1e-9)


@pytest.mark.parametrize("offset", [0.0, 9.81, 1e6])
def test_a_sine_amid_the_band_has_half_its_amplitude_squared_whatever_its_offset(offset):
    x = offset + 3.0 * np.sin(2 * np.pi * 7.0 * np.arange(1000) / 100.0 + 0.3)
    np.testing.assert_allclose(band_power(x)[199:], 4.5, rtol=1e-6)


def test_sines_outside_leave_nothing():
    t = np.arange(1000) / 100.0
    assert band_power(np.sin(2 * np.pi * 3.0 * t) + np.sin(2 * np.pi * 12.0 * t))[199:].max() < 1e-20


def test_power_does_not_depend_on_later_samples():
    x = np.random.default_rng(1).normal(size=600)
    another_future = x.copy()
    another_future[400:] = 1e3
    np.testing.assert_array_equal(band_power(x)[:400], band_power(another_future)[:400])


def test_hops_are_rows_of_the_full_rate():
    x = np.random.default_rng(2).normal(size=(777, 3))
    each_sample = band_power(x, hop=1)
    for hop in (2, 7.0, 200):
        np.testing.assert_allclose(band_power(x, hop=hop), each_sample[window_ends(777, 200, int(hop))], rtol=1e-12)


def test_short_and_empty_flights_have_no_powers():
    assert np.isnan(band_power(np.zeros((199, 2)))).all()
    assert band_power(np.zeros((0, 9))).shape == (0, 9)
    assert band_power(np.zeros((10, 9)), hop=5).shape == (0, 9)


def test_bins_of_the_band():
    assert band_bins(100.0, 200, (6.0, 8.0)) == (12, 16)


@pytest.mark.parametrize(("settings", "message"), [
    (dict(window=3), "window"), (dict(window=2.5), "window"), (dict(hop=0), "hop .* not 0"),
    (dict(band_hz=(8.0, 6.0)), "8 to 6 Hz"), (dict(band_hz=(0.0, 8.0)), "band"),
    (dict(band_hz=(6.0, 60.0)), "6 to 60 Hz holds no bin of a 200-sample .* 100 Hz; bins are 0.5 Hz .* to 50 Hz"),
    (dict(band_hz=(6.1, 6.2)), "6.1 to 6.2 Hz holds no bin"), (dict(sample_rate_hz=0.0), "rate .* not 0"),
    (dict(band_hz=(np.nan, 8.0)), "band must be .* not .nan"),
    (dict(window=201, band_hz=(49.9, 50.1)), "49.9 to 50.1 Hz"),
])
def test_settings_out_of_range_are_one_line_that_says_which(settings, message):
    with pytest.raises(AirTouchError, match=f"band power: .*{message}") as error:
        band_power(np.zeros(300), **settings)
    assert "\n" not in str(error.value)


def test_only_samples_in_one_column_or_in_several_are_taken():
    with pytest.raises(AirTouchError, match=r"not \(1, 2, 3\)"):
        band_power(np.zeros((1, 2, 3)))


def test_of_a_sine_in_the_lowest_bin_the_offset_is_none_of_the_power():
    """A Hann window spreads a sine of bin 1 onto bin 0: its basis has no mean of its own to lend to an offset."""
    x = 5.0 + 0.0 * np.arange(64)
    np.testing.assert_allclose(band_power(x, window=64, band_hz=(1.0, 2.0))[63:], 0.0, atol=1e-24)
