"""Noise of the IMU and lines of the rotors in simulated flights: each is named, and neither is called the other."""

import pytest

from airtouch.gap.answer.named_effects import named_effects
from airtouch.gap.evidence.data import Data
from airtouch.gap.naming.select import select
from airtouch.gap.signatures.candidates import all_candidates
from airtouch.simulation.effects import activate
from gap_flights import LOOP
from imu_flights import APART, FASTER, fly


def select_from(study, flights, without=LOOP):
    data = Data(study, flights)
    selection = select(data, all_candidates(without))
    return [s.name for s in selection.steps], {e.name: e.parameters for e in named_effects(data, selection)}


@pytest.mark.parametrize(("amplitude", "seed"), [(0.3, 41), (3.0, 43)])
def test_vibration_is_named_and_not_called_noise(study_apart, amplitude, seed):
    effects = [("vibration", {"amplitude": amplitude, "gyro": 0.05}), *APART]
    names, values = select_from(study_apart, fly(1, effects, seed=seed))
    assert names[0] == "vibration" and "imu_noise" not in names
    assert values["vibration"]["amplitude"].value == pytest.approx(amplitude, rel=0.2)


@pytest.mark.parametrize("seed", [44])
def test_lines_that_lie_upon_each_other_are_vibration_too(study, seed):
    """Rotors of one speed: how strong their lines are together depends on the flight, what they are does not."""
    names, _ = select_from(study, fly(1, {"vibration": {"amplitude": 1.0, "gyro": 0.05}}, seed=seed))
    assert names[0] == "vibration" and "imu_noise" not in names


@pytest.mark.parametrize(("factor", "seed"), [(1.2, 51), (3.0, 53)])
def test_noise_is_named_and_not_called_vibration(study, factor, seed):
    names, values = select_from(study, fly(1, {"imu_noise": {"factor": factor}}, seed=seed))
    assert names[0] == "imu_noise" and "vibration" not in names
    assert values["imu_noise"]["factor"].value == pytest.approx(factor, rel=0.2)


def test_lines_of_rotors_that_turn_at_another_speed_are_named(study):
    """Thrust over speed squared is not declared: the fold lies anywhere."""
    flights = fly(1, {"vibration": {"amplitude": 1.0, "gyro": 0.05}}, seed=46, vehicle=FASTER)
    names, _ = select_from(study, flights)
    assert names[0] == "vibration"


def test_effects_of_the_imu_alone_leave_still_flights_alone(study):
    names, _ = select_from(study, fly(1, activate({}), seed=61), ())
    assert not {"vibration", "imu_noise"} & set(names)
