"""Log blocks against the firmware's own sizes and units; rows out of packets."""

import struct

import numpy as np
import pytest
from fake_craft import FakeCraft

from airtouch.crazyflie.connection import blocks
from airtouch.crazyflie.connection.drone import drain
from airtouch.crazyflie.connection.intake import Intake
from airtouch.crazyflie.connection.log_blocks import Sample
from airtouch.crazyflie.view.host_detector import with_gaps
from airtouch.errors import AirTouchError

ALL = set(blocks.MOTION.names) | set(blocks.STATE.names)
VALUES = {"acc.x": 0.5, "acc.y": -0.25, "acc.z": 1.0, "gyro.x": 180.0, "gyro.y": -90.0, "gyro.z": 0.0, "motor.m1": 1,
          "motor.m2": 2, "motor.m3": 3, "motor.m4": 65535, "range.zrange": 1234, "pm.vbat": 3.75}


def test_sizes_are_those_of_the_packet():
    letters = {"FP16": "e", "uint16_t": "H", "int16_t": "h", "uint32_t": "I"}
    for block, size in ((blocks.MOTION, 24), (blocks.STATE, 26)):
        assert block.size == size == struct.calcsize("<" + "".join(letters[kind] for _, kind in block.variables))
        blocks.check(block, ALL)


def test_missing_variables_are_named_and_large_blocks_refused():
    with pytest.raises(AirTouchError, match="no log variable motor.m3, pm.vbat"):
        blocks.check(blocks.MOTION, ALL - {"motor.m3", "pm.vbat"})
    large = blocks.Block("large", 10, (*blocks.MOTION.variables, ("stateEstimate.x", "float")))
    with pytest.raises(AirTouchError, match="28 bytes, but a packet holds 26"):
        blocks.check(large, ALL | {"stateEstimate.x"})
    assert not set(blocks.available(blocks.STATE, ALL, blocks.MULTIRANGER).names) & blocks.MULTIRANGER


def test_units_are_si():
    columns = blocks.motion_columns([VALUES])
    assert columns["acc_x_mps2"] == pytest.approx(4.905) and columns["acc_z_mps2"] == pytest.approx(9.81)
    assert columns["gyro_x_radps"] == pytest.approx(np.pi, abs=1e-6) and columns["m4_pwm"] == 65535
    assert columns["zrange_m"] == pytest.approx(1.234) and columns["vbat_V"] == 3.75
    state = blocks.state_columns(blocks.STATE, [dict.fromkeys(blocks.STATE.names, 0) | {
        "stateEstimateZ.x": -1500, "stateEstimateZ.quat": 3 << 30, "range.left": 900, "range.right": 32767}])
    assert state["x_m"] == -1.5 and state["roll_rad"] == 0.0 and state["range_left_m"] == 0.9
    assert np.isnan(state["range_right_m"]) and np.isnan(state["range_front_m"])


def test_slow_values_hold_for_a_quarter_second_and_no_longer():
    fast = np.arange(0, 1, 0.01)
    values = blocks.hold(fast, np.array([0.2, 0.1]), {"x_m": np.array([2.0, 1.0])})["x_m"]
    assert np.isnan(values[:10]).all() and (values[10:20] == 1.0).all() and (values[20:46] == 2.0).all()
    assert np.isnan(values[46:]).all()
    assert np.isnan(blocks.hold(fast, np.empty(0), {"x_m": np.empty(0)})["x_m"]).all()


def test_intake_counts_what_is_lost_and_what_is_late():
    intake = Intake(None)
    for index in (0, 1, 2, 5, 4, 9):
        intake.take([Sample(blocks.MOTION.name, (2**24 - 20 + 10 * index) % 2**24, 100.0 + 0.01 * index, VALUES)])
    assert intake.received == 6 and intake.lost == 4
    assert intake.lateness_s == pytest.approx(0.0, abs=1e-9)
    intake.take([Sample(blocks.MOTION.name, 80, 100.15, VALUES)])
    assert intake.lateness_s == pytest.approx(0.05)


def test_intake_gives_every_column_that_it_names():
    craft, intake = FakeCraft(), Intake(blocks.STATE)
    while intake.received < 200:
        craft.sleep(0.02)
        times, columns = intake.take(drain(craft.samples))
        if len(times):
            assert sorted(columns) == sorted(n for n in intake.names if n != "t_s")
            assert {len(v) for v in columns.values()} == {len(times)}
    assert intake.supervisor == 0b1111 and intake.latest["x_m"] == 0.0


def test_gaps_become_missing_rows_for_the_detector_and_nothing_else():
    times = np.array([100, 110, 140, 130, 5000])
    clock, filled = with_gaps(times, {"a": np.arange(5.0)}, 80)
    assert list(clock[:6]) == [90, 100, 110, 120, 130, 140]
    np.testing.assert_array_equal(filled["a"][:6], [np.nan, 0, 1, np.nan, np.nan, 2])  # 130 came too late
    assert len(clock) == 6 + 100 + 1 and np.isnan(filled["a"][6:-1]).all() and filled["a"][-1] == 4
    clock, filled = with_gaps(np.array([50]), {"a": np.ones(1)}, 80)
    assert len(clock) == 0 and len(filled["a"]) == 0
