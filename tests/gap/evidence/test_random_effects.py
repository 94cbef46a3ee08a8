"""Noise and lines of the IMU: power in closed form and against simulated flights of other seeds, and their names."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import welch

from airtouch import vehicle as vehicles
from airtouch.gap.answer.named_effects import named_effects
from airtouch.gap.evidence import random_effects, vibration_lines
from airtouch.gap.evidence.data import Data
from airtouch.gap.flights import flight
from airtouch.gap.naming.select import select
from airtouch.gap.nominal import calibrate
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.signals.spectra import AIR, REST, frequencies
from airtouch.gap.signatures.candidates import all_candidates, terms
from airtouch.simulation.batch import flights as simulated
from airtouch.simulation.effects import activate
from airtouch.simulation.flight import prepare
from gap_flights import LOOP
from gap_flights import flight as made_flight

VEHICLE = vehicles.load()
#: rotors that turn at speeds of their own, as real ones do: else their lines add up as their phases happen to stand
APART = [("weak_motor", {"rotor": i, "thrust_loss": 0.01 * i}) for i in (1, 2, 3)]
HIDDEN = ("vbat_V", "rpm_1", "rpm_2", "rpm_3", "rpm_4")


def fly(count, effects=(), seed=0, vehicle=VEHICLE):
    logs = simulated("diagnosis", count, vehicle=vehicle, effects=effects, seed=seed, workers=1)
    return [flight.ready(replace(log, columns={k: v for k, v in log.columns.items() if k not in HIDDEN}), VEHICLE)
            for log in logs]


@pytest.fixture(scope="module")
def study_apart():
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


def test_lines_of_steady_rotors_lie_at_their_fold_with_their_power():
    turns = np.array([318.0, 327.0, 336.0, 345.0])
    speed = np.tile(2.0 * np.pi * turns, (400, 1))
    hover = 2.0 * np.pi * 327.0
    power = vibration_lines.folded(vibration_lines.two_sided(speed, hover, np.array([0, 128])))
    f = frequencies(AIR)
    for k, place in enumerate((18.0, 27.0, 36.0, 45.0)):
        line = power[0, np.abs(f - place) < 2.0].sum() * f[1]
        assert line == pytest.approx(0.5 * 0.5 ** 2 * (turns[k] / 327.0) ** 4, rel=0.02)
        assert abs(f[np.argmax(np.where(np.abs(f - place) < 4.0, power[0], 0.0))] - place) <= f[1]
    assert np.all(vibration_lines.folded(np.ones((1, 256)))[0, 1:-1] == 0.5)


def test_a_rotor_whose_speed_was_lost_turns_on():
    rpm = np.linspace(19000.0, 21000.0, 400)
    lost = (np.arange(400) % 40) < 3
    one = made_flight(4.0)
    one.log.columns.update({name: np.where(lost, np.nan, rpm) for name in vibration_lines.RPM})
    speed = vibration_lines.speeds(one, declared_study(VEHICLE, ()))
    assert speed == pytest.approx(np.tile(rpm[:, None] * np.pi / 30.0, 4), rel=1e-2)


def test_a_spread_keeps_the_power_and_has_its_width():
    speed = np.full((256, 4), 2.0 * np.pi * 325.0)
    sharp = vibration_lines.two_sided(speed, speed[0, 0], np.array([0]))
    wide = vibration_lines.widened(sharp, 3.0)
    assert wide.sum() == pytest.approx(sharp.sum(), rel=1e-6)
    f = np.fft.fftfreq(256, 0.01)
    middle = (f * wide[0]).sum() / wide.sum()
    near = np.abs(f - 25.0) < 12.0
    spread = np.sqrt(((f - middle) ** 2 * wide[0])[near].sum() / wide[0, near].sum())
    assert middle == pytest.approx(25.0, abs=0.3) and spread == pytest.approx(3.0, rel=0.1)


@pytest.mark.parametrize("cutoff", [0.0, 30.0])
def test_logged_noise_has_the_shape_of_filtered_white_noise(cutoff):
    row = prepare(replace(VEHICLE, acc_lowpass_hz=cutoff), ())[0][0]
    still = next(iter(simulated("hover", 1, vehicle=replace(VEHICLE, acc_lowpass_hz=cutoff), seed=5, workers=1)))
    white = np.random.default_rng(3).normal(size=500_000)
    if cutoff:
        from scipy.signal import butter, lfilter
        white = lfilter(*butter(2, cutoff, fs=500.0), white)
    white = white[::5] / white.std()
    f, power = welch(white, 100.0, nperseg=128)
    error = decibels(power, random_effects.logged_noise(row, f))[1:-1]
    assert np.abs(error).max() < 1.0 and abs(error.mean()) < 0.1
    at_rest = still.stack(["acc_x_mps2"])[:40, 0]  # and the simulator's rms is the declared one
    assert at_rest.std() == pytest.approx(VEHICLE.acc_noise_rms_mps2 * VEHICLE.acc_noise_ratio[0], rel=0.4)


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
