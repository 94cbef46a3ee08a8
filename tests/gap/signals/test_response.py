"""How the gyro follows logged commands: against the closed forms of errors in variables and of a closed loop."""

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.gap.flights.flight import ready_flights
from airtouch.gap.loop import controller, loop_model
from airtouch.gap.loop.axis_plant import axis_plant
from airtouch.gap.loop.command_response import acceleration_per_command
from airtouch.gap.loop.disturbed import Disturbed, disturbed
from airtouch.gap.loop.set_point_steps import NO_STEP
from airtouch.gap.signals import quiet_blocks
from airtouch.gap.signals.channels import COUNT, TORQUE, angular_acceleration, residual
from airtouch.gap.signals.response import FIRST_BIN, TorqueSpectra, response_of
from airtouch.gap.signals.spectra import AIR, frequencies, short_time_spectra, starts
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import batch
from airtouch.simulation.effects import Active, get
from airtouch.simulation.flight import prepare

BINS = len(frequencies(AIR))
NO_LOOP = Disturbed(np.zeros((BINS, 3)), np.zeros((BINS, 3)))


def noise(rng, size, rms=1.0):
    return rms * (rng.normal(size=size) + 1j * rng.normal(size=size)) / np.sqrt(2.0)


def flights(rng, true, alias, count=12, blocks=12):
    """Spectra measured and modelled: the vehicle feels `true` of what the log says, the rest is folded noise."""
    felt = [noise(rng, (blocks, BINS, 3), true) for _ in range(count)]
    commands = [t + noise(rng, t.shape, alias) for t in felt]
    return felt, commands


def torques(felt, commands):
    """The spectra of each flight: what the gyro measured, and what the model makes of the commands."""
    return [TorqueSpectra(f, w) for f, w in zip(felt, commands, strict=True)]


def test_share_is_that_of_errors_in_variables():
    rng = np.random.default_rng(1)
    felt, commands = flights(rng, 1.0, 1.0)
    response = response_of(torques(felt, commands), NO_LOOP)
    np.testing.assert_allclose(response.quiet_law.coherent.real, 1.0 / (1.0 + 1.0), atol=0.1)
    np.testing.assert_allclose(response.quiet_law.coherent.imag, 0.0, atol=0.1)


def test_a_share_no_surer_than_noise_is_not_believed():
    rng = np.random.default_rng(5)
    felt, commands = flights(rng, 1.0, 3.0)  # coherence 1 / (1 + 9)
    response = response_of(torques(felt, commands), NO_LOOP)
    assert np.median(np.abs(response.quiet_law.coherent)) == 0.0


def test_a_weaker_response_earns_nothing_on_nominal_flights():
    """With q = 1 half the response halves what folded noise leaves; with q as measured it adds to it."""
    rng = np.random.default_rng(2)
    felt, commands = flights(rng, 1.0, 2.0)
    response = response_of(torques(felt, commands), NO_LOOP)
    y, w = (x[0] for x in flights(rng, 1.0, 2.0, 1))
    def table(torque):
        return np.concatenate([np.zeros((*torque.shape[:2], 3)), torque,
                                               np.zeros((*torque.shape[:2], COUNT - 6))], axis=2)
    nominal, weaker = table(y - w), table(y - 0.5 * w)
    def size(x):
        return np.mean(np.abs(x[:, FIRST_BIN:, TORQUE]) ** 2)
    steady = response.quiet(w)
    assert steady.all()
    assert size(weaker) < 0.6 * size(nominal)
    before, after = (size(response.with_torque_gap(table(y - share * w), steady, TorqueSpectra(y, w, change)))
                     for share, change in ((1.0, None), (0.5, 0.5 * w)))
    assert after > before


def test_means_stay_as_they_are():
    rng = np.random.default_rng(3)
    felt, commands = flights(rng, 1.0, 2.0)
    response = response_of(torques(felt, commands), NO_LOOP)
    spectra = np.zeros((12, BINS, COUNT), complex)
    spectra[:, :, TORQUE] = felt[0] - commands[0]
    out = response.with_torque_gap(spectra, response.quiet(commands[0]), TorqueSpectra(felt[0], commands[0]))
    np.testing.assert_array_equal(out[:, :FIRST_BIN], spectra[:, :FIRST_BIN])


def test_blocks_in_which_a_set_point_stepped_have_a_law_and_a_weight_of_their_own():
    rng = np.random.default_rng(4)
    felt, commands = flights(rng, 1.0, 1.0, 12, 20)
    for f, w in zip(felt, commands, strict=True):  # every fourth block: a kick of which a third turns the vehicle
        kick = noise(rng, (5, BINS, 3), 30.0)
        w[::4] += kick
        f[::4] += kick / 3.0 + noise(rng, kick.shape, 3.0)
    response = response_of(torques(felt, commands), NO_LOOP)
    np.testing.assert_array_equal(response.quiet(commands[0])[:, 0], np.arange(20) % 4 != 0)
    np.testing.assert_allclose(np.abs(response.stepped_law.coherent), 1.0 / 3.0, atol=0.05)
    variances = 1.0 - 0.5, 9.0 + 4.0 / 9.0 + 1.0 / 9.0  # of power: of errors in variables; the kick's own scatter
    np.testing.assert_allclose(np.median(response.stepped_law.weight), np.sqrt(variances[0] / variances[1]), rtol=0.1)


@pytest.mark.parametrize("count", [2, 7, 8])
def test_a_response_needs_eight_quiet_blocks_on_each_axis(monkeypatch, count):
    """Of fewer blocks of noise the coherence is by chance as large as that of a response."""
    estimate = quiet_blocks.estimate_quiet_power

    def with_few_on_one_axis(modelled, power):
        found = estimate(modelled, power)
        quiet = np.ones_like(found[1])
        quiet[count:, 0] = False
        return found[0], quiet

    monkeypatch.setattr(quiet_blocks, "estimate_quiet_power", with_few_on_one_axis)
    response = response_of(torques(*flights(np.random.default_rng(9), 1.0, 1.0, 1, 40)), NO_LOOP)
    assert (response is None) == (count < 8)


@pytest.mark.parametrize("strength", [1.0, 1.8, 2.0, 3.0])
def test_flights_that_differ_so_much_that_an_axis_is_never_quiet_have_no_response(strength):
    """The share is 1/2 in all flights; two short ones are flown harder, so that no block is like those of the others.

    Without quiet blocks there is neither a share nor a floor to weight other blocks to: it would weight them by 0.
    """
    rng = np.random.default_rng(8)
    long, short = flights(rng, 1.0, 1.0, 1, 40), flights(rng, 1.0, 1.0, 2, 8)
    felt, commands = ([*a, *(strength * x for x in b)] for a, b in zip(long, short, strict=True))
    response = response_of(torques(felt, commands), NO_LOOP)
    assert (response is None) == (strength > 1.0)
    if response is not None:
        np.testing.assert_allclose(np.median(np.abs(response.quiet_law.coherent), axis=0), 0.5, atol=0.02)


def test_turning_under_an_outside_torque_is_the_closed_loop_s():
    """No gyro noise, no steps, no folds: u = -(K / s) d / (1 + P K), the vehicle turns by d / (1 + P K)."""
    row = prepare(vehicles.load("crazyflie-2.1-flow"), ())[0][0]
    c = controller.Controller(0.01, 6.0, 0.4)
    f = np.geomspace(0.8, 20.0, 12)
    s = 2j * np.pi * f
    roll = axis_plant(row, "roll")
    strengths = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    (expected,) = acceleration_per_command(c, roll, strengths, f, 0.0, [NO_STEP]).expected
    np.testing.assert_allclose(expected, -s / loop_model.loop_parts(c, roll, f).controller, rtol=1e-9)


def test_more_inertia_leaves_more_of_an_outside_torque():
    vehicle = vehicles.load("crazyflie-2.1-flow")
    f = frequencies(AIR)
    inertia = get("inertia")
    heavy = Active(inertia, inertia.values({"fraction": 1.0}))
    axes = {}
    for name, active in (("usual", ()), ("heavy", (heavy,))):
        row = prepare(vehicle, active)[0][0]
        axes[name] = np.abs(disturbed(controller.firmware_of(row), row, f).measured)
    low = (f > 0.5) & (f < 3.0)
    assert (axes["heavy"][low, :2] > 1.5 * axes["usual"][low, :2]).all()
    assert np.all(axes["usual"][f > 40.0] > 0.9)


def empirical(active: list[Active]) -> np.ndarray:
    """Angular acceleration for the torque of logged commands in simulated flights, S_yw / S_ww of roll, (bins,)."""
    vehicle, cross, power = vehicles.load("crazyflie-2.1-flow"), 0.0, 0.0
    outcomes = batch.flights("diagnosis", range(8), vehicle=vehicle, effects=active, workers=1)
    logs = [log for log in outcomes if isinstance(log, FlightLog)]
    for flight in ready_flights(logs, vehicle, []):
        first = starts(flight, AIR)
        turns = short_time_spectra(angular_acceleration(flight), first, AIR)[:, :, 0]
        modelled = turns - short_time_spectra(np.nan_to_num(residual(flight, vehicle)), first, AIR)[:, :, TORQUE.start]
        cross, power = cross + (turns * modelled.conj()).sum(axis=0), power + (np.abs(modelled) ** 2).sum(axis=0)
    return np.asarray(cross / power)


def test_a_late_gyro_changes_the_response_as_in_simulated_flights():
    """Noise of the gyro folds into log and command alike, through the gyro chip's own low-pass."""
    vehicle, f = vehicles.load("crazyflie-2.1-flow"), frequencies(AIR)
    late = Active(get("sensor_latency"), {"delay": 0.003})
    simulated = empirical([late]) / empirical([])
    noise_alone = np.eye(5)[0]
    predicted = []
    for active in ((), (late,)):
        row = prepare(vehicle, active)[0][0]
        predicted += acceleration_per_command(
            controller.firmware(row, "roll"), axis_plant(row, "roll"), noise_alone, f, 0.0, [NO_STEP]).expected
    band = (f > 15.0) & (f < 40.0)  # where it is noise of the gyro
    ratio = (simulated / (predicted[1] / predicted[0]))[band].reshape(-1, 8).mean(axis=1)
    np.testing.assert_allclose(np.angle(ratio), 0.0, atol=0.3)
    np.testing.assert_allclose(np.abs(ratio), 1.0, atol=0.25)
