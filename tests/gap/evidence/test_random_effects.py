"""Power that random effects add: in closed form, and against simulated flights of other seeds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, get_window, lfilter, welch
from scipy.stats import norm
from scipy.stats import t as student

from airtouch import vehicle as vehicles
from airtouch.gap.evidence import random_effects
from airtouch.gap.evidence.data import Data
from airtouch.gap.signals.channels import FORCE, TORQUE
from airtouch.gap.signals.spectra import AIR, LENGTH, REST, frequencies
from airtouch.gap.signatures.candidates import terms
from airtouch.simulation.batch import flights as simulated
from airtouch.simulation.flight import prepare
from hovers import FLOOR, LIFT_N, PLACE, hover
from imu_flights import APART, fly

VEHICLE = vehicles.load()
CHANCE = 1e-3  #: that right powers exceed one of the limits of a comparison
#: dB by which a right model of the loop may be off where chance allows less: it knows the gyro's noise by its share of
#: the commands alone; chosen
LOOP_DB = 1.2


def decibels(measured, expected):
    return 10.0 * np.log10(measured / expected)


def of_mean(blocks, bins=1, length=LENGTH[AIR]):
    """Standard deviation, over the mean, of the mean of a periodogram's values in so many blocks and bins.

    Values of noise are exponential, with a standard deviation as large as the mean (of so many blocks the mean is a
    chi-square of twice as many degrees of freedom). SciPy's Hann window says how far values correlate: the square of
    its overlap with itself by half a block, and of its square's spectrum one bin and two bins off.
    """
    window = get_window("hann", length)
    half, spectrum = window[length // 2:] @ window[:length // 2], np.abs(np.fft.rfft(window ** 2))
    of_blocks = 1.0 + 2.0 * (half / spectrum[0]) ** 2 * (1.0 - 1.0 / blocks)
    lags = np.arange(1, min(bins, 3))
    of_bins = 1.0 + 2.0 * ((spectrum[lags] / spectrum[0]) ** 2 * (1.0 - lags / bins)).sum()
    return np.sqrt(of_blocks / blocks * of_bins / bins)


def limit(scatter, values):
    """Decibels within which that many values lie, but for CHANCE, whose relative standard deviation is `scatter`."""
    return decibels(1.0 + norm.isf(0.5 * CHANCE / values) * scatter, 1.0)


def in_bands(f, edges):
    """Number of bins of each band."""
    return [int(((f >= a) & (f < b)).sum()) for a, b in zip(edges, edges[1:], strict=False)]


def bands(power, f, edges):
    """Mean power (bands, channels) of (blocks, bins, channels); blocks that tell nothing are NaN."""
    within = [(f >= a) & (f < b) for a, b in zip(edges, edges[1:], strict=False)]
    return np.array([np.nanmean(power[:, w], axis=(0, 1)) for w in within])


def added_power(data, name, **values):
    term = replace(terms(name)[0], values={**terms(name)[0].values, **values})
    return random_effects.extra_power(data, term)


@pytest.mark.parametrize("cutoff", [0.0, 30.0])
def test_logged_noise_has_the_shape_of_filtered_white_noise(cutoff):
    row = prepare(replace(VEHICLE, acc_lowpass_hz=cutoff), ())[0][0]
    still = next(iter(simulated("hover", 1, vehicle=replace(VEHICLE, acc_lowpass_hz=cutoff), seed=5, workers=1)))
    white = np.random.default_rng(3).normal(size=500_000)
    if cutoff:
        white = lfilter(*butter(2, cutoff, fs=500.0), white)
    white = white[::5] / white.std()
    f, power = welch(white, 100.0, nperseg=128, detrend=False)
    error = decibels(power, random_effects.logged_noise(row, f))[1:-1]
    blocks = 2 * len(white) // 128 - 1
    assert np.abs(error).max() < limit(of_mean(blocks, 1, 128), len(error))
    assert abs(error.mean()) < limit(of_mean(blocks, len(error), 128), 1)
    at_rest = still.stack(["acc_x_mps2"])[:40, 0]  # and the simulator's rms is the declared one
    scatter = norm.isf(0.5 * CHANCE) / np.sqrt(2.0 * 40)  # of the standard deviation of 40 normal values
    assert at_rest.std() == pytest.approx(VEHICLE.acc_noise_rms_mps2 * VEHICLE.acc_noise_ratio[0], rel=scatter)


@pytest.fixture(scope="module")
def steady():
    """A hover at a constant thrust; nothing is known of its floor but the sensors' noise."""
    return Data(FLOOR, [hover(1, length_s=12.0)])


@pytest.mark.parametrize("time", [0.005, 0.02, 0.1])
def test_power_of_thrust_noise_is_that_of_drawn_noise(steady, time):
    """First-order noise on each rotor's thrust, drawn at 5 kHz and logged as the sensors do: SciPy's periodograms.

    The accelerometer is sampled, the gyro's differences are means over a sample.
    """
    rms, per_sample, step = 0.1, 50, 2e-4
    decay = np.exp(-step / time)
    white = np.random.default_rng(8).normal(size=(1_500_000, 4))
    drawn = rms * LIFT_N * lfilter([np.sqrt(1.0 - decay ** 2)], [1.0, -decay], white, axis=0)
    arm = VEHICLE.arm_m / np.sqrt(2.0)
    front, left, yaw = (np.array([PLACE[i][k] for i in (1, 2, 3, 4)]) for k in range(3))
    turning = drawn @ np.column_stack([left * arm, -front * arm, -yaw * VEHICLE.yaw_torque_over_thrust_m])
    turning = (turning / np.array(VEHICLE.inertia_kg_m2)).reshape(-1, per_sample, 3).mean(axis=1)
    lifting = (drawn.sum(axis=1) / VEHICLE.mass_kg)[::per_sample]
    f, power = welch(np.column_stack([lifting, turning]), 100.0, nperseg=LENGTH[AIR], axis=0)
    term = next(t for t in terms("motor_noise") if t.values["time"] == time)
    expected = random_effects.extra_power(steady, replace(term, values={**term.values, "rms": rms}))[0]
    model = expected[AIR][0][:, [FORCE.stop - 1, *range(TORQUE.start, TORQUE.stop)]]
    above = 2.0 / np.pi * np.arctan(1.0 / (2.0 * np.pi * 250.0 * time))  # share of the lift's power above 250 Hz:
    model[:, 0] += above * 4.0 * (rms * LIFT_N / VEHICLE.mass_kg) ** 2 / 50.0  # it folds evenly, and is left out
    error, edges = decibels(power, model), (1.0, 5.0, 15.0, 30.0, 49.0)
    blocks = 2 * len(lifting) // LENGTH[AIR] - 1
    for of_band, bins in zip(bands(error[None], f, edges), in_bands(f, edges), strict=True):
        assert np.abs(of_band).max() < limit(of_mean(blocks, bins), 16)
    assert not expected[AIR][:, :, :FORCE.stop - 1].any() and not expected[REST].any()


def test_within_a_gate_a_block_has_that_share_of_the_power(steady):
    """The share of the window's square, SciPy's Hann window, that the gate covers."""
    (noise,) = terms("imu_noise")
    gate = (("synthetic", 3.0, 5.5), ("another", 0.0, 12.0))
    one = noise.fitted(np.ones(1))
    whole, gated = (random_effects.extra_power(steady, replace(one, gate=g))[0][AIR] for g in ((), gate))
    window = get_window("hann", LENGTH[AIR]) ** 2
    t = 0.01 * np.arange(1200)
    acts = (t >= 3.0 - 1e-9) & (t < 5.5 - 1e-9)
    share = np.array([(window * acts[k:k + LENGTH[AIR]]).sum() for k in steady.block_starts[0][AIR]]) / window.sum()
    assert share.min() == 0.0 and share.max() > 0.9 and len(set(share)) > 3
    np.testing.assert_allclose(gated, share[:, None, None] * whole, atol=1e-12 * whole.max())


def test_power_grows_with_the_square_of_a_strength_and_with_that_of_a_factor_less_one(steady):
    """Of a factor on noise that is there already the square less 1 is added."""
    (noise,), lines = terms("imu_noise"), terms("vibration")[0]
    (unit, half), one = ([noise.at(np.array([x]))["factor"] for x in (1.0, 0.5)]), random_effects.growth
    assert one(lines, 3.0) == 9.0 and one(noise, 0.0) == 0.0 and one(noise, 1.0) == 1.0
    assert one(noise, 0.5) == pytest.approx((half ** 2 - 1.0) / (unit ** 2 - 1.0)) and one(noise, -0.2) == 0.0
    twice, thrice = (added_power(steady, "imu_noise", factor=x)[0][AIR] for x in (2.0, 3.0))
    np.testing.assert_allclose(thrice, twice * (9.0 - 1.0) / (4.0 - 1.0))


def test_power_of_noise_is_that_of_simulated_flights(study):
    """Flights of one seed without and with twice the noise, against what is expected to be added.

    The noise n is nearly all that the flights without hold, so |2n|^2 - |n|^2 = 3|n|^2 scatters as |n|^2 does. Of roll
    and pitch, which the loop moves, LOOP_DB is allowed.
    """
    calm, noisy = (Data(study, fly(4, e, seed=7)) for e in ((), {"imu_noise": {"factor": 2.0}}))
    expected = added_power(calm, "imu_noise", factor=2.0)
    f = frequencies(AIR)
    before, after = (np.concatenate([np.abs(b[AIR]) ** 2 for b in d.residual]) for d in (calm, noisy))
    blocks = len(before)
    model = np.concatenate([e[AIR] for e in expected])
    edges = (4.0, 10.0, 20.0, 35.0, 50.0)
    before, after, model = (bands(x[:, :, :6], f, edges) for x in (before, after, model))
    error = decibels(after - before, model)
    for of_band, bins in zip(error, in_bands(f, edges), strict=True):
        by_chance = limit(of_mean(blocks, bins), 24)
        assert np.abs(of_band[[0, 1, 2, 5]]).max() < by_chance
        assert np.abs(of_band[3:5]).max() < max(by_chance, LOOP_DB)
    resting = [np.concatenate([np.abs(b[REST][:, :, :3]) ** 2 for b in d.residual]) for d in (calm, noisy)]
    ground = np.concatenate([e[REST] for e in expected])[:, :, :3].mean(axis=(0, 1))
    grown = resting[1].mean(axis=(0, 1)) - resting[0].mean(axis=(0, 1))
    few = limit(of_mean(*resting[0].shape[:2], LENGTH[REST]), 3)
    assert np.abs(decibels(grown, ground)).max() < few


@pytest.mark.parametrize("amplitude", [0.5, 2.0])
def test_power_of_lines_is_that_of_simulated_flights(study_apart, amplitude):
    """Forces within the scatter of the mean of the flight's blocks; the gyro's axes, which the loop moves, LOOP_DB."""
    effects = [("vibration", {"amplitude": amplitude, "gyro": 0.05}), *APART]
    data = Data(study_apart, fly(2, effects, seed=11))
    expected = added_power(data, "vibration", amplitude=amplitude, gyro=0.05)
    f = frequencies(AIR)
    for b, e in zip(data.residual, expected, strict=True):
        measured = np.abs(b[AIR][:, :, :6]) ** 2 - study_apart.floor.power[AIR][:, :6]
        modelled = np.where(np.isnan(measured), np.nan, e[AIR][:, :, :6])
        total = decibels(bands(measured, f, (4.0, 50.0)), bands(modelled, f, (4.0, 50.0)))[0]
        of_blocks = np.nanmean(measured[:, f >= 4.0, :3], axis=1)
        scatter = of_blocks.std(axis=0, ddof=1) / of_blocks.mean(axis=0) / np.sqrt(len(of_blocks))
        wide = student.isf(0.5 * CHANCE / 3, len(of_blocks) - 1)  # of Student's law, as the scatter is estimated
        assert (np.abs(total[:3]) < decibels(1.0 + wide * scatter, 1.0)).all()
        assert np.abs(total[3:]).max() < LOOP_DB
        over = np.median(np.abs(b[AIR][:, 12:-1, :3]) ** 2 / (e[AIR] + study_apart.floor.power[AIR])[:, 12:-1, :3])
        assert 0.3 < over < 1.2  # the median of an exponential is 0.69: the power lies in the right bins
        assert np.all(e[REST] == 0.0)
