"""The emulated firmware around the simulator's vehicle:
what the desktop's half does, and with a checkout a whole flight."""

import os
import shutil
import struct
from pathlib import Path

import numpy as np
import pytest

from airtouch.simulation import loop, scenario
from airtouch.simulation.firmware import setpoint
from airtouch.simulation.flight import choose
from airtouch.simulation.scenario import draw_flight
from tools.emulate import build, compare, flight, height
from tools.emulate import plant as at
from tools.emulate.plant import Plant

HOVER = """
name = "short-hover"
[mission]
control = "velocity"
[[mission.step]]
do = "wait"
time_s = 0.5
[[mission.step]]
do = "take-off"
height_m = 0.5
[[mission.step]]
do = "hover"
time_s = 2.0
"""


@pytest.fixture(scope="module")
def image():
    base = os.environ.get("CRAZYFLIE_BASE")
    if not base or not all(map(shutil.which, ("arm-none-eabi-gcc", "qemu-system-arm"))):
        pytest.skip("set CRAZYFLIE_BASE to a checkout of the firmware, and install arm-none-eabi-gcc and "
                    "qemu-system-arm")
    build.compile_firmware(Path(base), "app-config-height")
    return build.link()


@pytest.fixture
def plant():
    plan = draw_flight(scenario.parse(HOVER, "hover"), 1, 0)
    return Plant(plan, compare.vehicle(), 1, 0, choose(plan))


def test_a_vehicle_at_rest_reads_gravity_and_stays(plant):
    for _ in range(500):
        assert plant.step(np.zeros(4)) == loop.OK
    assert np.abs(plant.place[:2]).max() < 1e-6 and abs(plant.place[2]) < 0.02
    assert plant.readings[at.ACC + 2] == pytest.approx(9.81, abs=1.0) and 0.0 <= plant.readings[at.RANGE] < 0.03


def test_motors_lift_it(plant):
    for _ in range(500):
        plant.step(np.full(4, 60_000.0))
    assert plant.place[2] > 0.5 and plant.readings[at.RANGE] == pytest.approx(plant.place[2], abs=0.2)


def test_sensors_get_the_chips_own_units():
    readings, rest = np.zeros(at.READINGS), np.zeros(2)
    readings[at.ACC + 2], readings[at.ACC + 5] = 9.81, 1e4
    readings[at.GYRO] = np.deg2rad(100.0)
    readings[at.RANGE], readings[at.FLOW:at.FLOW + 2] = 0.8, (3.4, -2.0)
    values = struct.unpack("<12hH2h", flight.sensor_block(readings, rest))
    assert values[0] == round(100.0 / (4000 / 65536)) and values[8] == round(65536 / 48) and values[11] == 32767
    assert values[12] == 800 and values[13:] == (2, -3) and rest == pytest.approx([0.4, 0.0])
    readings[at.RANGE] = np.nan
    assert struct.unpack("<12hH2h", flight.sensor_block(readings, rest))[12] == flight.NO_RANGE_MM
    assert rest == pytest.approx([-0.2, 0.0]), "parts of counts are owed"


def test_set_points_are_packets_in_the_drones_own_axes():
    row = np.zeros(setpoint.SETPOINT_SIZE)
    row[setpoint.MOTORS], row[setpoint.VX], row[setpoint.Z], row[setpoint.YAW] = 1.0, 0.3, 0.8, np.pi / 2
    kind, length, header, order, ahead, left, rate, height = struct.unpack("<BBBBffff", flight.set_point_packet(row))
    assert (kind, length, header >> 4, header & 3, order) == (0, 18, 7, 0, 5)
    assert (ahead, left, rate, height) == pytest.approx((0.0, -0.3, 0.0, 0.8), abs=1e-6)
    row[setpoint.MOTORS] = 0.0
    assert flight.set_point_packet(row)[3:] == b"\0"


def test_a_command_that_differs_is_counted():
    one = flight.Flown(pwm=np.full((100, 4), 40_000, np.uint16))
    other = flight.Flown(pwm=one.pwm.copy())
    assert compare.differing(one, other)[0] == 0
    other.pwm[60, 2] += 3
    assert compare.differing(one, other) == (1, 100, 60, 3)


@pytest.mark.slow
def test_the_firmware_flies_and_the_app_changes_no_command(image):
    flown = scenario.parse(HOVER, "hover")
    on, off, again = (flight.fly(image, flown, compare.vehicle(), 1, app=app, whole_milliseconds=True)
                      for app in (True, False, True))
    assert on.ending == off.ending == "ok"
    hover = on.table[-100:]
    assert np.abs(hover[:, 3] - 0.5).max() < 0.12 and np.abs(hover[:, 1:3]).max() < 0.3
    assert compare.differing(on, off)[:2] == (0, len(off.pwm)) and len(on.pwm) == len(off.pwm)
    assert (on.pwm == again.pwm).all() and on.pwm.max() > 20_000
    assert on.late == 0 and min(on.left.values()) > 0


@pytest.mark.slow
def test_the_height_is_kept_over_a_platform_where_it_is_asked_for(image):
    case = height.CASES[0]
    low, high = height.kept(flight.fly(image, height.mission(case), compare.vehicle(), 1,
                                       parameters={"atHeight.enable": 1}))
    assert 0.7 < low < high < 0.95
    stock = flight.fly(image, height.mission(case), compare.vehicle(), 1)
    assert height.kept(stock)[1] > 1.2, "the shipped firmware climbs"
