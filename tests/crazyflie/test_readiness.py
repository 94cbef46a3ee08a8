"""A drone on the ground: what it is asked, and what is made of its answers."""

import math
import queue
from threading import Event

import pytest

from airtouch.crazyflie import readiness
from airtouch.crazyflie.checks import Condition
from airtouch.crazyflie.connection import blocks
from airtouch.crazyflie.connection.log_blocks import Sample
from airtouch.errors import AirTouchError


class Drone:
    """A drone that knows these parameters and log variables; a parameter of None gets no answer."""

    def __init__(self, parameters=None, variables=()):
        self.parameters, self.variables, self.changes = dict(parameters or {}), set(variables), []

    def has_parameter(self, name):
        return name in self.parameters

    def parameter(self, name, patience_s):
        return self.parameters.get(name)

    def set_parameter(self, name, text):
        self.changes.append((name, text))

    def trigger(self, name):
        self.changes.append((name, "1"))


def test_a_deck_is_attached_or_not_or_not_known():
    drone = Drone({"deck.bcFlow2": 1, "deck.bcAI": 0, "deck.bcLoco": None})
    assert readiness.has_deck(drone, "bcFlow2") is True and readiness.has_deck(drone, "bcAI") is False
    assert readiness.has_deck(drone, "bcMultiranger") is None
    with pytest.raises(AirTouchError, match="deck.bcLoco: the drone does not tell its parameters"):
        readiness.has_deck(drone, "bcLoco")


@pytest.mark.parametrize("modified, revision", [(0, "0a1b2c3d00ef"), (1, "0a1b2c3d00ef+"), (None, "0a1b2c3d00ef")])
def test_the_firmware_is_48_bits_of_its_commit(modified, revision):
    parameters = {"firmware.revision0": 0x0A1B2C3D, "firmware.revision1": 0xEF, "firmware.modified": modified}
    assert readiness.firmware(Drone(parameters)) == revision


def test_firmware_that_says_nothing_is_unknown():
    assert readiness.firmware(Drone({"firmware.revision0": 1})) == "unknown"


def test_the_slow_block_has_what_the_drone_has():
    everything = blocks.STATE.names
    assert readiness.slow_block(Drone(variables=everything), {"bcMultiranger": True}).names == everything
    no_multiranger = readiness.slow_block(Drone(variables=everything), {"bcMultiranger": False}).names
    assert set(everything) - set(no_multiranger) == blocks.MULTIRANGER
    assert readiness.slow_block(Drone(variables=["acc.x"]), {}) is None


def test_only_a_virtual_drone_starts_over():
    virtual, real = Drone({"sitl.startOver": 0}), Drone()
    for drone in (virtual, real):
        readiness.start_over(drone)
    assert virtual.changes == [("sitl.startOver", "1")] and real.changes == []


def test_the_origin_is_the_estimate_and_zero_where_there_is_none():
    origin = readiness.origin_of({"x_m": 0.3, "y_m": math.nan, "yaw_rad": -1.0})
    assert (origin.x_m, origin.y_m, origin.z_m, origin.yaw_rad) == (0.3, 0.0, 0.0, -1.0)


class StandingDrone(Drone):
    """A drone on the ground that sends packets; its down range reads so many millimetres."""

    def __init__(self, zrange_mm):
        super().__init__()
        self.zrange_mm = zrange_mm

    @property
    def samples(self):
        packets = queue.SimpleQueue()
        values = dict.fromkeys(blocks.MOTION.names, 0.0) | {"range.zrange": self.zrange_mm, "pm.vbat": 4.0}
        for index in range(3):
            packets.put(Sample(blocks.MOTION.name, 10 * index, 0.01 * index, values))
        return packets


@pytest.mark.parametrize(("zrange_mm", "fault"), [(20, None), (290, None), (310, "reads 0.31 m"),
                                                  (8191, "reads nan m")])
def test_the_down_range_is_checked_again_before_each_flight(monkeypatch, zrange_mm, fault):
    """It was read once, before the first of several flights."""
    monkeypatch.setattr(readiness, "FIRST_DATA_S", 0.1)
    before = readiness.Readiness(Condition(4.0, {"bcFlow2": True}, None, 0.02), None, "unknown")
    if fault is None:
        assert readiness.settle(StandingDrone(zrange_mm), before, 3.7, Event()).latest["vbat_V"] == 4.0
        return
    with pytest.raises(AirTouchError, match=f"not ready: the down range {fault} on the ground"):
        readiness.settle(StandingDrone(zrange_mm), before, 3.7, Event())
