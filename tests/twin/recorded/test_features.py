"""Features of a flight against SciPy and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import spectrogram

from airtouch.twin.recorded import channels as ch
from airtouch.twin.recorded.channels import channels
from airtouch.twin.recorded.course import course
from airtouch.twin.recorded.features import BANDS_HZ, BINS_S, CLASSES, LENGTH, PAIRS, features, height_class, names

NAMES = [f.name for f in names()]


def rows(group):
    return [k for k, f in enumerate(names()) if f.group == group]


def noise_log(log, motors, rates):
    """A flight whose motors' roll command and roll rate are given series."""
    columns = {f"m{i + 1}_pwm": 45000.0 + 0.25 * sign * motors for i, sign in enumerate((-1, -1, 1, 1))}
    return log.with_columns({**columns, "gyro_x_radps": np.deg2rad(rates)})


@pytest.fixture(scope="module")
def long_flight(sweeps):
    """A flight of 80 s of free air: the first one, stretched by repeating its hover."""
    log, sweep = sweeps[0][1], course(sweeps[0][1])
    piece = np.arange(sweep.level + 120, sweep.level + 420)
    order = np.r_[np.arange(sweep.level + 420), np.tile(piece, 26), np.arange(sweep.level + 420, len(log))]
    extra = 26 * 300
    stretched = log.with_columns({k: v[order] for k, v in log.columns.items()})
    return stretched, replace(sweep, step=sweep.step + extra, entry=sweep.entry + extra, exit=sweep.exit + extra,
                              landing=sweep.landing + extra)


def test_spectra_are_scipys_of_the_calm_half(long_flight):
    """SciPy's spectrogram, averaged over the half of the blocks with the least roll and pitch rate."""
    log, sweep = long_flight
    rng = np.random.default_rng(0)
    rates = {f"gyro_{axis}_radps": np.deg2rad(rng.normal(0.0, 3.0, len(log))) for axis in "xy"}
    values = features(log.with_columns(rates), sweep)
    f, _, density = spectrogram(channels(log.with_columns(rates))[sweep.free], fs=100.0, window=np.hanning(LENGTH),
                                nperseg=LENGTH, noverlap=LENGTH - LENGTH // 2, detrend="linear", axis=0)
    motion = density[:, [ch.GYRO_X, ch.GYRO_Y]].sum(axis=(0, 1))
    calm = density[..., np.argsort(motion)[:(len(motion) + 1) // 2]].mean(axis=-1)
    scale = 10 * np.log10(100.0 * (np.hanning(LENGTH) ** 2).sum() / 2.0)  # one-sided density to |FFT|^2
    for k, name in ((ch.GYRO_X, "gyro x"), (ch.YAW, "motor yaw")):
        for a, b in BANDS_HZ[1:-1]:
            expected = 10 * np.log10(calm[(f >= a) & (f < b), k].mean()) + scale
            assert values[NAMES.index(f"{name} {a:g}-{b:g} Hz")] == pytest.approx(expected, abs=0.01)


def test_coherency_has_the_phase_of_a_delay(long_flight):
    """The rate follows the command by 30 ms: coherency e^(-i w 30 ms) while it is whole."""
    log, sweep = long_flight
    rng = np.random.default_rng(1)
    command = rng.normal(0.0, 800.0, len(log))
    values = features(noise_log(log, command, 0.01 * np.roll(command, 3)), sweep)
    assert PAIRS[0] == (ch.GYRO_X, ch.ROLL)
    for a, b in BANDS_HZ[1:6]:
        real, imaginary = (values[NAMES.index(f"gyro x with motor roll {a:g}-{b:g} Hz {part}")]
                           for part in ("re", "im"))
        f = np.fft.rfftfreq(LENGTH, 0.01)
        w = 2 * np.pi * f[(f >= a) & (f < b)]
        assert complex(real, imaginary) == pytest.approx(np.exp(-1j * w * 0.03).mean(), abs=0.08)


def test_channels_that_have_nothing_to_do_with_each_other_are_as_coherent_as_scipy_finds_them(long_flight):
    """Chance alone, some 1/sqrt(spectra averaged): by SciPy's complex spectra of the calm half of the blocks."""
    log, sweep = long_flight
    rng = np.random.default_rng(2)
    log = noise_log(log, rng.normal(0.0, 800.0, len(log)), rng.normal(0.0, 3.0, len(log)))
    values = features(log, sweep)
    f, _, spectra = spectrogram(channels(log)[sweep.free], fs=100.0, window=np.hanning(LENGTH), nperseg=LENGTH,
                                noverlap=LENGTH - LENGTH // 2, detrend="linear", axis=0, mode="complex")
    motion = (np.abs(spectra[:, [ch.GYRO_X, ch.GYRO_Y]]) ** 2).sum(axis=(0, 1))
    calm = spectra[..., np.argsort(motion)[:(len(motion) + 1) // 2]]
    coherencies = []
    for a, b in BANDS_HZ:
        rate, command = (calm[(f >= a) & (f < b), k].ravel() for k in (ch.GYRO_X, ch.ROLL))
        expected = np.vdot(command, rate) / np.sqrt(np.vdot(rate, rate).real * np.vdot(command, command).real)
        found = [values[NAMES.index(f"gyro x with motor roll {a:g}-{b:g} Hz {part}")] for part in ("re", "im")]
        assert complex(*found) == pytest.approx(expected, abs=1e-3)
        coherencies += found
    assert np.abs(coherencies).mean() < 0.1


def test_spectra_are_those_of_the_calm_half_of_a_hover(long_flight):
    """A push by hand in one block of three, twenty times as strong as the air, changes no spectrum by 2 dB."""
    log, sweep = long_flight
    rng = np.random.default_rng(3)
    rate, command = rng.normal(0.0, 3.0, len(log)), rng.normal(0.0, 800.0, len(log))
    pushed = rate.copy()
    pushed[sweep.free.start + 2 * LENGTH::6 * LENGTH] += 400.0
    calm, steered = (features(noise_log(log, command, r), sweep) for r in (rate, pushed))
    places = [k for k in rows("spectrum") if NAMES[k].startswith("gyro x")]
    assert np.abs(steered[places] - calm[places]).max() < 2.0


def test_edge_means_are_those_of_the_channels(sweeps):
    _, log, _ = sweeps[1]
    sweep = course(log)
    x, values = channels(log), features(log, sweep)
    level = x[sweep.entry - 100:sweep.entry - 40].mean(axis=0)
    name = height_class(sweep.clearance_m)
    for a, b in BINS_S[:6]:
        part = x[sweep.entry + round(100 * a):sweep.entry + round(100 * b)].mean(axis=0)
        az = values[next(k for k in rows("entry") if NAMES[k] == f"{name} az {a:+g}..{b:+g} s")]
        down = values[next(k for k in rows("entry") if NAMES[k] == f"{name} down range {a:+g}..{b:+g} s")]
        assert az == pytest.approx(part[ch.AZ] - level[ch.AZ], abs=1e-9)
        assert down == pytest.approx(part[ch.DOWN], abs=1e-9)
    other_names = [k for k in rows("entry") if not NAMES[k].startswith(name)]
    assert np.isnan(values[other_names]).all()


def test_height_classes_cover_what_flies():
    assert [height_class(h) for h in (0.01, 0.05, 0.08, 0.5)] == [*CLASSES, None]


def test_hover_level_and_slope(sweeps):
    _, log, _ = sweeps[0]
    sweep = course(log)
    t = np.arange(len(log)) * 0.01
    ramp = log.with_columns({f"m{i}_pwm": 40000.0 + 70.0 * t for i in range(1, 5)})
    values = features(ramp, sweep)
    assert values[NAMES.index("hover PWM slope")] == pytest.approx(70.0, rel=1e-6)
    assert values[NAMES.index("trim motor roll")] == pytest.approx(0.0, abs=1e-6)


def test_a_sample_without_motor_commands_changes_the_hover_level_by_nothing_to_speak_of(sweeps):
    """One of some hundred samples of a ramp of 70 PWM/s holds the one before, 0.7 PWM below."""
    _, log, _ = sweeps[0]
    sweep = course(log)
    pwm = 40000.0 + 70.0 * np.arange(len(log)) * 0.01
    whole, gap = pwm.copy(), pwm.copy()
    gap[sweep.free.start + 50] = np.nan
    of = [features(log.with_columns({f"m{i}_pwm": p for i in range(1, 5)}), sweep) for p in (whole, gap)]
    for name, near in (("hover PWM", 0.01), ("hover PWM slope", 0.1)):
        k = NAMES.index(name)
        assert of[1][k] == pytest.approx(of[0][k], abs=near)
    assert of[0][NAMES.index("hover PWM")] == pytest.approx(pwm[sweep.free].mean(), rel=1e-12)
