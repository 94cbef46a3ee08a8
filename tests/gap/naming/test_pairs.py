"""What is named beside what: two effects of one flight, and effects of the loop that close next to nothing."""

from dataclasses import replace

import pytest

import airtouch.gap.diagnosis as diagnose
from airtouch.gap.answer.shrink import gap_of
from airtouch.gap.evidence.data import Data
from airtouch.gap.naming.select import select
from airtouch.gap.naming.unknown import is_explained
from airtouch.gap.result import Quantity, Shrink
from airtouch.gap.signatures.candidates import all_candidates
from gap_flights import fly

#: those that were taken for one of a pair, and the pairs' own
CANDIDATES = ("actuator_delay", "com_offset", "controller_gain", "imu_bias", "imu_noise", "inertia", "motor_lag",
              "motor_noise", "sensor_latency", "thrust_coefficient", "vibration", "wind")


@pytest.mark.parametrize("effects", [
    {"com_offset": {"x": -0.0004, "y": -0.0006}, "actuator_delay": {"delay": 0.0045}},  # a fit that began at nothing
    {"imu_bias": {"acc_x": 0.04, "acc_y": 0.02, "acc_z": -0.02, "gyro_x": 0.001, "gyro_y": -0.005, "gyro_z": 0.003},
     "actuator_delay": {"delay": 0.005}},  # a screening that saw no bias
    {"vibration": {"amplitude": 1.0}, "thrust_coefficient": {"loss": 0.004}},  # a share of what acts elsewhere
])
def test_both_effects_are_named_and_nothing_else(study, effects):
    """Each was missed beside the other once: by the fit, by screening, by what the first must leave."""
    selection = select(Data(study, fly(1, 91, effects)), {n: v for n, v in all_candidates().items() if n in CANDIDATES})
    assert {s.name for s in selection.named_steps} == set(effects)
    assert is_explained(selection)


@pytest.fixture(scope="module")
def delayed(study):
    """A study as of recorded flights, a flight with a delay held against it, and what is selected there."""
    recorded = replace(study, scatter=replace(study.scatter, exact=False))
    data = Data(recorded, fly(1, 93, {"actuator_delay": {"delay": 0.005}}))
    return recorded, data, select(data, all_candidates())


@pytest.mark.parametrize("closes", [True, False])
def test_in_recorded_flights_a_loop_effect_must_close_a_part_of_the_gap(delayed, monkeypatch, closes):
    """It is named with the share of the gap that it takes away; with less than the loop model's error it is not."""
    recorded, data, selection = delayed
    requests = []
    monkeypatch.setattr(diagnose, "select", lambda *of, **_: requests.append(of[0]) or selection)  # it looks at no gap
    if not closes:
        little = Shrink(1.4, 1.36, Quantity(0.1))
        monkeypatch.setattr(diagnose, "gap_of", lambda *of: replace(gap_of(*of), shrink=little))
    diagnosis = diagnose.diagnose_with_study(recorded, data.flights, data=data)
    assert requests == [data]
    assert [e.name for e in diagnosis.effects] == (["actuator_delay"] if closes else [])
    assert (diagnosis.verdict == "effect") == closes
