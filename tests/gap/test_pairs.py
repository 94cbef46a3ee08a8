"""Two effects in one flight: both are found beside each other."""

import pytest

from airtouch.gap.candidates import every
from airtouch.gap.data import Data
from airtouch.gap.select import select
from gap_flights import flown


@pytest.mark.parametrize("effects", [
    {"com_offset": {"x": -0.0004, "y": -0.0006}, "actuator_delay": {"delay": 0.0045}},  # a fit that began at nothing
    {"imu_bias": {"acc_x": 0.04, "acc_y": 0.02, "acc_z": -0.02, "gyro_x": 0.001, "gyro_y": -0.005, "gyro_z": 0.003},
     "actuator_delay": {"delay": 0.005}},  # a first look that saw no bias
    {"vibration": {"amplitude": 1.0}, "thrust_coefficient": {"loss": 0.004}},  # a share of what acts elsewhere
])
def test_both_effects_are_named_and_nothing_else(study, effects):
    """Each was missed beside the other once: by the fit, by the first look, by what the first must leave."""
    chosen = select(Data(study, flown(1, 91, effects)), every())
    alike = {"mass": "thrust_coefficient"}  # one thing in these logs
    assert {alike.get(s.name, s.name) for s in chosen.named} == set(effects)
    assert chosen.free_after < chosen.allowed
