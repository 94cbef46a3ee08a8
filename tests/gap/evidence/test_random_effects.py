"""Noise and lines of the IMU: power in closed form and against simulated flights of other seeds, and their names."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, get_window, lfilter, welch

from airtouch import vehicle as vehicles
from airtouch.gap.answer.named_effects import named_effects
from airtouch.gap.evidence import random_effects, vibration_lines
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights import flight
from airtouch.gap.naming.select import select
from airtouch.gap.nominal import calibrate
from airtouch.gap.signals.channels import FORCE, TORQUE
from airtouch.gap.signals.spectra import AIR, LENGTH, REST, frequencies
from airtouch.gap.signatures.candidates import all_candidates, terms
from airtouch.simulation.batch import flights as simulated
from airtouch.simulation.effects import activate
from airtouch.simulation.flight import prepare
from gap_flights import LOOP
from hovers import FLOOR, LIFT_N, PLACE, hover

VEHICLE = vehicles.load()
#: rotors that turn at speeds of their own, as real ones do: else their lines add up as their phases happen to stand
APART = [("weak_motor", {"rotor": i, "thrust_loss": 0.01 * i}) for i in (1, 2, 3)]
HIDDEN = ("vbat_V", "rpm_1", "rpm_2", "rpm_3", "rpm_4")


def fly(count, effects=(), seed=0, vehicle=VEHICLE):
    logs = simulated("diagnosis", count, vehicle=vehicle, effects=effects, seed=seed, workers=1)
    return [flight.ready(replace(log, columns={k: v for k, v in log.columns.items() if k not in HIDDEN}), VEHICLE)
            for log in logs]


@pytest.fixture(scope="module")
def study_apart(study):
    """Of rotors at speeds of their own; how nominal flights scatter is what it is for rotors of one speed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(calibrate, "baseline_scatter", lambda *_: study.scatter)
        return calibrate.calibrated(VEHICLE, fly(3, APART, seed=31))[0]


def decibels(measured, expected):
    return 10.0 * np.log10(measured / expected)


def bands(power, f, edges):
    """Mean power (bands, channels) of (blocks, bins, channels); blocks that tell nothing are NaN."""
    within = [(f >= a) & (f < b) for a, b in zip(edges, edges[1:], strict=False)]
    return np.array([np.nanmean(power[:, w], axis=(0, 1)) for w in within])


def added_power(data, name, **values):
    term = replace(terms(name)[0], values={**terms(name)[0].values, **values})
    return random_effects.power(data, term)


@pytest.mark.parametrize("cutoff", [0.0, 30.0])
def test_logged_noise_has_the_shape_of_filtered_white_noise(cutoff):
    row = prepare(replace(VEHICLE, acc_lowpass_hz=cutoff), ())[0][0]
    still = next(iter(simulated("hover", 1, vehicle=replace(VEHICLE, acc_lowpass_hz=cutoff), seed=5, workers=1)))
    white = np.random.default_rng(3).normal(size=500_000)
    if cutoff:
        white = lfilter(*butter(2, cutoff, fs=500.0), white)
    white = white[::5] / white.std()
    f, power = welch(white, 100.0, nperseg=128)
    error = decibels(power, random_effects.logged_noise(row, f))[1:-1]
    assert np.abs(error).max() < 1.0 and abs(error.mean()) < 0.1
    at_rest = still.stack(["acc_x_mps2"])[:40, 0]  # and the simulator's rms is the declared one
    assert at_rest.std() == pytest.approx(VEHICLE.acc_noise_rms_mps2 * VEHICLE.acc_noise_ratio[0], rel=0.4)


@pytest.fixture(scope="module")
def steady():
    """A hover at a constant thrust; nothing is known of its floor but the sensors' noise."""
    return Data(FLOOR, [hover(1, length_s=12.0)])


@pytest.mark.parametrize("time", [0.005, 0.02, 0.1])
def test_power_of_thrust_noise_is_that_of_drawn_noise(steady, time):
    """First-order noise on each rotor's thrust, drawn at 10 kHz and logged as the sensors do: SciPy's periodograms.

    The accelerometer is sampled, the gyro's differences are means over a sample.
    """
    rms, every, step = 0.1, 100, 1e-4
    decay = np.exp(-step / time)
    white = np.random.default_rng(8).normal(size=(1_500_000, 4))
    drawn = rms * LIFT_N * lfilter([np.sqrt(1.0 - decay ** 2)], [1.0, -decay], white, axis=0)
    arm = VEHICLE.arm_m / np.sqrt(2.0)
    front, left, yaw = (np.array([PLACE[i][k] for i in (1, 2, 3, 4)]) for k in range(3))
    turning = drawn @ np.column_stack([left * arm, -front * arm, -yaw * VEHICLE.yaw_torque_over_thrust_m])
    turning = (turning / np.array(VEHICLE.inertia_kg_m2)).reshape(-1, every, 3).mean(axis=1)
    lifting = (drawn.sum(axis=1) / VEHICLE.mass_kg)[::every]
    f, power = welch(np.column_stack([lifting, turning]), 100.0, nperseg=LENGTH[AIR], axis=0)
    term = next(t for t in terms("motor_noise") if t.values["time"] == time)
    expected = random_effects.power(steady, replace(term, values={**term.values, "rms": rms}))[0]
    error = decibels(power, expected[AIR][0][:, [FORCE.stop - 1, *range(TORQUE.start, TORQUE.stop)]])
    edges = (1.0, 5.0, 15.0, 30.0, 49.0)
    short = 2.0 / np.pi * np.arctan(1.0 / (2.0 * np.pi * 250.0 * time))  # of the lift, what folds from above 250 Hz
    error[:, 0] += decibels(1.0 - short, 1.0)
    assert np.abs(bands(error[None], f, edges)).max() < 0.3
    assert not expected[AIR][:, :, :FORCE.stop - 1].any() and not expected[REST].any()


def test_within_a_gate_a_block_has_that_share_of_the_power(steady):
    """The share of the window's square, SciPy's Hann window, that the gate covers."""
    (noise,) = terms("imu_noise")
    gate = (("synthetic", 3.0, 5.5), ("another", 0.0, 12.0))
    whole, gated = (random_effects.power(steady, replace(noise.fitted(np.ones(1)), gate=g))[0][AIR] for g in ((), gate))
    window = get_window("hann", LENGTH[AIR]) ** 2
    t = 0.01 * np.arange(1200)
    acts = (t >= 3.0 - 1e-9) & (t < 5.5 - 1e-9)
    share = np.array([(window * acts[k:k + LENGTH[AIR]]).sum() for k in steady.first[0][AIR]]) / window.sum()
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
    """Flights of one seed without and with twice the noise, against what is expected to be added."""
    calm, noisy = (Data(study, fly(4, e, seed=7)) for e in ((), {"imu_noise": {"factor": 2.0}}))
    expected = added_power(calm, "imu_noise", factor=2.0)
    f = frequencies(AIR)
    before, after = (np.concatenate([np.abs(b[AIR]) ** 2 for b in d.base]) for d in (calm, noisy))
    model = np.concatenate([e[AIR] for e in expected])
    edges = (4.0, 10.0, 20.0, 35.0, 50.0)
    error = decibels(bands(after, f, edges) - bands(before, f, edges), bands(model, f, edges))
    assert np.abs(error[:, [0, 1]]).max() < 0.6  # forces, which the loop hardly moves
    assert np.abs(error[:, 5]).max() < 1.0
    # roll and pitch: in the lowest band the loop shakes, four flights hold few such swings
    assert np.nanmax(np.abs(error[0, 3:5])) < 2.0 and np.nanmax(np.abs(error[1:, 3:5])) < 1.2
    at_rest = [np.concatenate([np.abs(b[REST]) ** 2 for b in d.base]).mean(axis=(0, 1)) for d in (calm, noisy)]
    ground = np.concatenate([e[REST] for e in expected]).mean(axis=(0, 1))
    assert np.abs(decibels(at_rest[1] - at_rest[0], ground))[:3].max() < 1.2  # some seconds only


@pytest.mark.parametrize("amplitude", [0.5, 2.0])
def test_power_of_lines_is_that_of_simulated_flights(study_apart, amplitude):
    effects = [("vibration", {"amplitude": amplitude, "gyro": 0.05}), *APART]
    data = Data(study_apart, fly(2, effects, seed=11))
    expected = added_power(data, "vibration", amplitude=amplitude, gyro=0.05)
    f = frequencies(AIR)
    for b, e in zip(data.base, expected, strict=True):
        measured = np.abs(b[AIR][:, :, :6]) ** 2 - study_apart.floor.power[AIR][:, :6]
        modelled = np.where(np.isnan(measured), np.nan, e[AIR][:, :, :6])
        total = decibels(bands(measured, f, (4.0, 50.0)), bands(modelled, f, (4.0, 50.0)))[0]
        assert np.abs(total[:2]).max() < 1.0
        assert np.nanmax(np.abs(total[3:6])) < 3.0
        over = np.median(np.abs(b[AIR][:, 12:-1, :3]) ** 2 / (e[AIR] + study_apart.floor.power[AIR])[:, 12:-1, :3])
        assert 0.3 < over < 1.2  # the median of an exponential is 0.69: the power lies in the right bins
        assert np.all(e[REST] == 0.0)


def select_from(study, flights, without=LOOP):
    data = Data(study, flights)
    selection = select(data, all_candidates(without))
    return [s.name for s in selection.steps], {e.name: e.parameters for e in named_effects(data, selection)}, data


@pytest.mark.parametrize(("amplitude", "seed"), [(0.3, 41), (3.0, 43)])
def test_vibration_is_named_and_not_called_noise(study_apart, amplitude, seed):
    effects = [("vibration", {"amplitude": amplitude, "gyro": 0.05}), *APART]
    names, values, _ = select_from(study_apart, fly(1, effects, seed=seed))
    assert names[0] == "vibration" and "imu_noise" not in names
    assert values["vibration"]["amplitude"].value == pytest.approx(amplitude, rel=0.2)


@pytest.mark.parametrize("seed", [44])
def test_lines_that_lie_upon_each_other_are_vibration_too(study, seed):
    """Rotors of one speed: how strong their lines are together depends on the flight, what they are does not."""
    names, _, _ = select_from(study, fly(1, {"vibration": {"amplitude": 1.0, "gyro": 0.05}}, seed=seed))
    assert names[0] == "vibration" and "imu_noise" not in names


@pytest.mark.parametrize(("factor", "seed"), [(1.2, 51), (3.0, 53)])
def test_noise_is_named_and_not_called_vibration(study, factor, seed):
    names, values, _ = select_from(study, fly(1, {"imu_noise": {"factor": factor}}, seed=seed))
    assert names[0] == "imu_noise" and "vibration" not in names
    assert values["imu_noise"]["factor"].value == pytest.approx(factor, rel=0.2)


def test_rotors_that_turn_at_another_speed_are_found_where_they_are(study):
    """Thrust over speed squared is not declared: the fold lies anywhere."""
    other = replace(VEHICLE, thrust_per_speed2=1.9e-8)
    flights = fly(1, {"vibration": {"amplitude": 1.0, "gyro": 0.05}}, seed=46, vehicle=other)
    names, _, data = select_from(study, flights)
    assert names[0] == "vibration"
    turns = [np.sqrt(VEHICLE.mass_kg * VEHICLE.gravity_mps2 / 4.0 / k) / (2.0 * np.pi) for k in (1.9e-8, 2.1e-8)]
    assert vibration_lines.lines(data).shift * frequencies(AIR)[1] == pytest.approx(turns[0] - turns[1], abs=1.2)


def test_effects_of_the_imu_alone_leave_still_flights_alone(study):
    names, _, _ = select_from(study, fly(1, activate({}), seed=61), ())
    assert not {"vibration", "imu_noise"} & set(names)
