"""What to do next, by what the answer leaves open."""

import shlex
from dataclasses import replace
from types import SimpleNamespace

import pytest

from airtouch.gap.answer.advice import MISSIONS, collect_command, next_steps, simulate_command
from airtouch.gap.result import NamedEffect, Quantity
from airtouch.gap.signatures.alike import ALIKE, CONFUSED, MISSION
from airtouch.simulation import effects as registry
from airtouch.simulation.effects import EFFECTS
from made_diagnosis import VEHICLE, cell, diagnosis

WITH_GYRO = [SimpleNamespace(rates=())]
BASELINE = ("nominal.csv",)


def advice(answer, flights=WITH_GYRO):
    return next_steps(replace(answer, baseline=BASELINE, indistinguishable=()), flights, VEHICLE)


def test_named_effects_are_switched_on_in_the_simulator():
    (step,) = advice(diagnosis())
    words = shlex.split(step.command)
    assert words[words.index("--vehicle") + 1] == VEHICLE.name
    assert words[words.index("--effect") + 1] == "imu_bias:acc_x=0.8m/s^2"


def test_a_passing_effect_is_said_to_act_for_the_whole_flight_in_the_simulator():
    (step,) = advice(diagnosis(effects=(NamedEffect("wind", {}, seconds=(("a.csv", 1.0, 2.0),)),)))
    assert "acts for the whole flight" in step.text


def test_what_is_named_without_a_baseline_is_not_to_be_trained_on():
    without = next_steps(replace(diagnosis(), baseline=(), indistinguishable=()), WITH_GYRO, VEHICLE)
    assert without[0].text.startswith("Give flights") and "do not train" in without[1].text
    assert not any("do not train" in step.text for step in advice(diagnosis()))


@pytest.mark.parametrize("vehicle", [replace(VEHICLE, name="my drone"), replace(VEHICLE, mass_kg=0.05)])
def test_a_vehicle_of_a_file_of_its_own_is_named_by_a_file(vehicle):
    """`--vehicle` takes no name of a vehicle that is not built in, and would take another one for one that is."""
    answer = replace(diagnosis(), baseline=())
    commands = [step.command for step in next_steps(answer, WITH_GYRO, vehicle) if "--vehicle" in step.command]
    assert len(commands) == 2 and all("--vehicle VEHICLE.toml" in command for command in commands)


def test_none_asks_for_nothing_to_be_added():
    (step,) = advice(diagnosis(verdict="none", effects=()))
    assert step.text.startswith("Nothing to add") and not step.command


@pytest.mark.parametrize(("groups", "baseline", "gyro"), [
    ((("none", "slung_load"),), BASELINE, True), ((), (), True), ((), BASELINE, False)])
def test_none_that_leaves_something_to_do_does_not_say_that_there_is_nothing(groups, baseline, gyro):
    answer = replace(diagnosis(verdict="none", effects=()), baseline=baseline, indistinguishable=groups)
    steps = next_steps(answer, WITH_GYRO if gyro else [SimpleNamespace(rates=None)], VEHICLE)
    assert steps and not any("Nothing to add" in step.text for step in steps)


def test_none_with_a_floor_that_is_extrapolated_asks_for_another_baseline():
    answer = replace(diagnosis(verdict="none", effects=()), baseline=BASELINE, indistinguishable=())
    (step,) = next_steps(answer, WITH_GYRO, VEHICLE, extrapolated=True)
    assert step.text.startswith("Fly the baseline like the test")


@pytest.mark.parametrize("phase", sorted(MISSIONS))
def test_an_open_gap_is_flown_again_in_its_phase(phase):
    again, own = advice(diagnosis([cell("force_z", phase, 1.0)], "unknown", ()))
    assert again.command == collect_command(MISSIONS[phase]) and "--effect-file" in own.command


def test_an_open_gap_at_landing_is_flown_again_as_it_was():
    again, _ = advice(diagnosis([cell("force_z", "landing", 1.0)], "unknown", ()))
    assert "same flight three times" in again.text and not again.command


def test_a_baseline_that_is_missing_comes_first_then_effects_that_look_alike():
    answer = replace(diagnosis(), baseline=())
    baseline, alike, switch_on, gyro = next_steps(answer, [SimpleNamespace(rates=None)], VEHICLE)
    assert alike.text.startswith("To tell mass from thrust_coefficient: ")
    assert "--effect" in switch_on.command and "--baseline" in baseline.command and "gyro" in gyro.text


@pytest.mark.parametrize(("group", "told"), [
    (("mass", "thrust_coefficient"), ["mass from thrust_coefficient"]),
    (("actuator_delay", "inertia", "motor_lag"), ["actuator_delay from motor_lag", "inertia from motor_lag"]),
    (("inertia", "mass", "thrust_coefficient"), ["mass from thrust_coefficient",
                                                 "inertia from mass from thrust_coefficient"]),
    (("mass", "none"), ["mass from no effect"]),
    (("blade_flapping", "none", "rotor_drag"), ["blade_flapping from rotor_drag",
                                                "blade_flapping and rotor_drag from no effect"])])
def test_a_remedy_is_that_of_the_effects_it_names(group, told):
    steps = next_steps(replace(diagnosis(), baseline=BASELINE, indistinguishable=(group,)), WITH_GYRO, VEHICLE)
    assert [step.text.split(":")[0].removeprefix("To tell ") for step in steps[:-1]] == told


def test_advised_commands_are_valid():
    """Every effect's command is taken by `simulate` as it stands, and every mission advised can be loaded."""
    from airtouch.crazyflie import mission

    for name, effect in EFFECTS.items():
        values = {p.name: Quantity(p.default * 1.23456789 if p.low <= p.default * 1.23456789 <= p.high
                                   and not p.integer else p.default, unit=p.unit) for p in effect.parameters}
        line = simulate_command([NamedEffect(name, values)], VEHICLE.name)
        parsed_effect = registry.parse(line.split("--effect ")[1].strip("'"))
        expected = {k: q.value for k, q in values.items()}
        assert parsed_effect[0] == name and parsed_effect[1] == pytest.approx(expected, rel=1e-3)
    for name in (*MISSIONS.values(), *(c.mission for c in (*ALIKE, *CONFUSED) if c.mission), MISSION):
        assert mission.load(name).legs
