"""Command view: the loop model against simulated closed loops, and effects that only the commands show."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import welch

from airtouch import vehicle as vehicles
from airtouch.gap.edges import edge_response
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import fit
from airtouch.gap.evidence.judge import judge
from airtouch.gap.flights import flight
from airtouch.gap.loop import command_spectra, controller, identify, loop_model, noise_spectra
from airtouch.gap.loop.axis_plant import axis_plant
from airtouch.gap.loop.command_response import acceleration_per_command
from airtouch.gap.loop.set_point_steps import NO_STEP
from airtouch.gap.naming import judging, policy
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.signatures.candidates import terms
from airtouch.simulation import scenario
from airtouch.simulation.batch import flights as simulated
from airtouch.simulation.effects import Active, activate
from airtouch.simulation.flight import prepare

VEHICLE = vehicles.load()
LONG = """
name = "long hover"
[mission]
step = [{ do = "wait", time_s = 0.5 }, { do = "take-off", height_m = 0.8 }, { do = "hover", time_s = 60.0 },
        { do = "land" }]
"""


def fly(scene, count, effects=(), seed=0):
    off = scenario.load(scene).table.get("effects", {}) if isinstance(scene, str) else ()
    off = [e for e in off if e not in dict(effects)]
    logs = list(simulated(scene, count, vehicle=VEHICLE, effects=effects, without=off, seed=seed, workers=1))
    return [flight.ready(log, VEHICLE) for log in logs]


@pytest.fixture(scope="module")
def study():
    return declared_study(VEHICLE, fly("paper-mixed", 6, seed=9))


def held_out_gain(study, flights, name):
    """Held-out gain and the mean of the two halves' fitted values, of the effect's best variant."""
    data = Data(study, flights)
    halves = judging.halves(data)
    best = (-np.inf, {})
    for term in terms(name):
        gain, values = 0.0, []
        for train, test in (halves, halves[::-1]):
            result = fit(data, train, (term,))
            gain += judge(data, test, result.terms) - judge(data, test, ())
            values.append(result.terms[0].values)
        best = max(best, (gain, {k: np.mean([v[k] for v in values]) for k in values[0]}), key=lambda b: b[0])
    return best


@pytest.fixture(scope="module")
def nominal():
    return spectrum({})


def spectrum(effects):
    total = 0.0
    for log in simulated(scenario.parse(LONG, "long hover"), 8, vehicle=VEHICLE, effects=effects, workers=1):
        commands = VEHICLE.thrust(log.stack([f"m{i}_pwm" for i in (1, 2, 3, 4)])) @ command_spectra.MIX.T
        f, power = welch(commands[500:6000, :3], 100.0, nperseg=command_spectra.COMMAND_LENGTH, axis=0)
        total = total + power
    return total[np.isin(f, command_spectra.command_frequencies())]


@pytest.mark.parametrize("effects", [
    {"sensor_latency": {"delay": 0.004}}, {"sensor_latency": {"delay": 0.006}}, {"sensor_latency": {"delay": 0.008}},
    {"controller_gain": {"rate": 0.7}}, {"controller_gain": {"rate": 1.0, "height": 1.5}},
    {"motor_lag": {"factor": 1.5}}, {"inertia": {"fraction": 0.4}}, {"mass": {"fraction": 0.13}}])
def test_predicted_ratio_is_that_of_the_simulated_loop(nominal, effects):
    row, with_effects = prepare(VEHICLE, ())[0][0], prepare(VEHICLE, activate(effects))[0][0]
    measured = spectrum(effects)
    for i, axis in enumerate(controller.AXES):
        strengths = identify.noise_strengths(
            controller.firmware(row, axis), axis_plant(row, axis), nominal[:, i]).strengths
        f, fine = command_spectra.command_frequencies(), command_spectra.fine_frequencies()
        expected = command_spectra.through_window(strengths @ noise_spectra.noise_power(
            controller.firmware(with_effects, axis), axis_plant(with_effects, axis), fine))
        expected /= command_spectra.through_window(strengths @ noise_spectra.noise_power(
            controller.firmware(row, axis), axis_plant(row, axis), fine))
        error = 10.0 * np.log10(measured[:, i] / nominal[:, i] / expected)
        assert np.abs(error).mean() < 0.6
        assert np.abs(error[f < 5.0]).max() < 1.5  # where 8 ms make the loop ring, its power grows by 10 dB


def test_latency_is_found_with_its_value(study):
    late = fly("paper-mixed", 1, {"sensor_latency": {"delay": 0.008}}, seed=1)
    gain, values = held_out_gain(study, late, "sensor_latency")
    assert gain > 50.0
    assert values["delay"] == pytest.approx(0.008, rel=0.25)


def test_lower_rate_gain_is_found_and_is_no_latency(study):
    flights = fly("paper-mixed", 2, {"controller_gain": {"rate": 0.7}}, seed=1)
    gain, values = held_out_gain(study, flights, "controller_gain")
    assert gain > 12.0
    assert values["rate"] == pytest.approx(0.7, rel=0.15)
    assert held_out_gain(study, flights, "sensor_latency")[0] < gain


def test_range_step_is_found_at_edges(study):
    flights = fly("paper-mixed", 8, {"range_step": {"residual": 0.02, "kick": 0.05}}, seed=2)
    gain, values = held_out_gain(study, flights, "range_step")
    assert gain > 12.0
    assert values["kick"] == pytest.approx(0.05, rel=0.3)
    assert values["residual"] == pytest.approx(0.02, rel=0.5)


def test_flow_scale_is_found_at_edges(study):
    flights = fly("paper-mixed", 8, {"flow_scale": {"share": 0.0, "transient": 0.3}}, seed=2)
    assert held_out_gain(study, flights, "flow_scale")[0] > 6.0


@pytest.mark.parametrize("name", ["sensor_latency", "controller_gain", "range_step", "flow_scale"])
def test_nominal_flights_give_nothing(study, name):
    for k in range(3):
        assert held_out_gain(study, fly("paper-mixed", 1, seed=20 + k), name)[0] < policy.FIRST_GAIN


def test_without_edges_range_step_changes_nothing(study):
    flights = fly("hover", 1)
    assert edge_response.edges_of(flights[0]) == []
    assert any("edge" in reason for reason in flights[0].cannot)
    assert held_out_gain(study, flights, "range_step")[0] == pytest.approx(0.0, abs=1e-6)


def test_the_controller_of_the_firmware_is_recognised(study):
    assert study.loop.by_firmware


def test_a_loop_that_would_not_fly_is_recognised():
    slow = prepare(VEHICLE, activate({"sensor_latency": {"delay": 0.03}}))[0][0]
    row = prepare(VEHICLE, ())[0][0]
    assert loop_model.excess_phase(controller.firmware(row, "roll"), axis_plant(row, "roll")) < 0.0
    assert loop_model.excess_phase(controller.firmware(slow, "roll"), axis_plant(slow, "roll")) > 0.0


@pytest.mark.parametrize("factor", np.geomspace(0.5, 3.0, 9))
def test_the_excess_phase_is_that_where_the_gain_is_last_one(factor):
    """Against a grid of 100 000 frequencies; the loop's own has 160, of which neighbours differ by some 0.05 rad."""
    row = prepare(VEHICLE, ())[0][0]
    c, plant = controller.firmware(row, "roll"), axis_plant(row, "roll")
    plant = plant._replace(acceleration=factor * plant.acceleration)
    f = np.geomspace(0.3, 45.0, 100_000)
    parts = loop_model.loop_parts(c, plant, f)
    open_loop = parts.plant * parts.controller
    last = np.flatnonzero(np.abs(open_loop) > 1.0)[-1]
    beyond_half_a_turn = np.mod(-np.angle(open_loop[last]), 2.0 * np.pi) - np.pi
    assert loop_model.excess_phase(c, plant) == pytest.approx(beyond_half_a_turn, abs=2e-3)


@pytest.mark.parametrize("field", ["gyro_lowpass", "rate_scale", "gravity", "thrust_scale", "rotor_y"])
def test_ratio_and_share_follow_whatever_an_effect_sets_in_the_plant(study, field):
    """A user's effect may set any field; what was worked out for the vehicle as it is must not be given for it."""
    def settings(row, values):
        row[field] = row[field] * values["factor"]

    base = activate({"inertia": {"fraction": 0.0}})[0].effect
    factor = replace(base.parameters[0], name="factor", default=1.5, low=0.5, high=2.0, neutral=1.0)
    own = replace(base, name="own", parameters=(factor,), settings=settings, wrench=None)
    loop = study.loop
    assert loop.ratio(()) == pytest.approx(1.0)
    assert np.abs(np.log(loop.ratio((Active(own, {"factor": 1.5}),)))).max() > 0.01
    assert loop.ratio((Active(own, {"factor": 1.0}),)) == pytest.approx(1.0)


def leaves(table):
    """Every number of a structured array, as views of one element."""
    if table.dtype.names:
        for name in table.dtype.names:
            yield from leaves(table[name])
    else:
        flat = table.reshape(-1)
        yield from (flat[k:k + 1] for k in range(len(flat)))


def test_rows_alike_in_their_loop_have_the_same_spectra():
    """What the spectra are kept by leaves no number of the plant out that they depend on."""
    plant, f = prepare(VEHICLE, ())[0].copy(), np.array([0.7, 2.0, 9.0, 31.0])
    row, strengths = plant[0], np.ones(5)

    def spectra_of(axis):
        c = controller.firmware(row, axis)
        part = axis_plant(row, axis)
        spectra = [noise_spectra.noise_power(c, part, f), loop_model.excess_phase(c, part)]
        if axis != "thrust":
            spectra += [*acceleration_per_command(c, part, strengths, f, 0.0, [NO_STEP]).expected,
                        loop_model.torque_per_command(c, part, f)]
        return (c, part), np.concatenate([np.ravel(x) for x in spectra])

    before, different = {axis: spectra_of(axis) for axis in controller.AXES}, 0
    for number in leaves(plant):
        original = number.copy()
        another = 1.07 * original + 1e-3 if number.dtype.kind == "f" else original + 1
        number[...] = ~original if number.dtype == bool else another
        for axis, (key, earlier) in before.items():
            group, now = spectra_of(axis)
            different += group != key
            if group == key:
                np.testing.assert_array_equal(now, earlier)
        number[...] = original
    assert different > 50  # else nothing was changed


def test_effects_are_told_apart_by_the_names_of_their_values(study):
    """Not by their order: of one gain of 0.7 and one of 1 each is the other's."""
    effect = activate({"controller_gain": {"rate": 0.7}})[0].effect
    f, rest = command_spectra.command_frequencies(), {"position": 1.0, "height": 1.0}
    rate, attitude, same = (study.loop.torque_change((Active(effect, values),), f).share for values in
                            (rest | {"rate": 0.7, "attitude": 1.0}, rest | {"attitude": 0.7, "rate": 1.0},
                             {"attitude": 1.0, "rate": 0.7} | rest))
    assert np.array_equal(rate, same) and not np.allclose(rate, attitude)
