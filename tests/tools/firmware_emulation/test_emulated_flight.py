"""The emulated firmware around the simulator's vehicle:
what the desktop's half does, and with a checkout a whole flight."""

import os
import shutil
import struct
from pathlib import Path

import numpy as np
import pytest

from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.simulation import loop, scenario
from airtouch.simulation.firmware import setpoint
from airtouch.simulation.flight import choose
from airtouch.simulation.scenario import draw_flight
from airtouch.simulation.sensors import log_row
from tools.firmware_emulation import build, compare, flight, height, missions, side_by_side
from tools.firmware_emulation import plant as at
from tools.firmware_emulation.plant import Plant

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


def test_full_thrust_lifts_the_drone_and_the_range_sees_it(plant):
    for _ in range(500):
        plant.step(np.full(4, 60_000.0))
    assert plant.place[2] > 0.5 and plant.readings[at.RANGE] == pytest.approx(plant.place[2], abs=0.2)


def test_sensors_get_the_chips_own_units():
    readings, flow = np.zeros(at.READINGS), np.zeros(2)
    readings[at.ACC + 2], readings[at.ACC + 5] = 9.81, 1e4
    readings[at.GYRO] = np.deg2rad(100.0)
    readings[at.RANGE], readings[at.FLOW:at.FLOW + 2] = 0.8, (3.4, -2.0)
    values = struct.unpack("<12hH2h", flight.sensor_block(readings, flow))
    assert values[0] == round(100.0 / (4000 / 65536)) and values[8] == round(65536 / 48) and values[11] == 32767
    assert values[12] == 800 and values[13:] == (2, -3) and flow == pytest.approx([0.4, 0.0])
    readings[at.RANGE] = np.nan
    assert struct.unpack("<12hH2h", flight.sensor_block(readings, flow))[12] == flight.NO_RANGE_MM
    assert flow == pytest.approx([-0.2, 0.0]), "parts of counts are owed"


def test_set_points_are_packets_in_the_drones_own_axes():
    row = np.zeros(setpoint.SETPOINT_SIZE)
    row[setpoint.MOTORS], row[setpoint.VX], row[setpoint.Z], row[setpoint.YAW] = 1.0, 0.3, 0.8, np.pi / 2
    kind, length, header, order, ahead, side, rate, height = struct.unpack("<BBBBffff", flight.set_point_packet(row))
    assert (kind, length, header >> 4, header & 3, order) == (0, 18, 7, 0, 5)
    assert (ahead, side, rate, height) == pytest.approx((0.0, -0.3, 0.0, 0.8), abs=1e-6)
    row[setpoint.MOTORS] = 0.0
    assert flight.set_point_packet(row)[3:] == b"\0"


def test_a_command_that_differs_is_counted():
    flight_a = flight.EmulatedFlight(pwm=np.full((100, 4), 40_000, np.uint16))
    flight_b = flight.EmulatedFlight(pwm=flight_a.pwm.copy())
    assert compare.differing(flight_a, flight_b)[0] == 0
    flight_b.pwm[60, 2] += 3
    assert compare.differing(flight_a, flight_b) == (1, 100, 60, 3)


class Desk:
    """A board on a desk: its motors stand still. `said` is what it received."""

    said: list[bytes] = []
    console = "Self test passed!"

    def __init__(self, _elf, _mode, names, **_options):
        self.names = names
        Desk.said = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def on(self, _kind, _handler):
        pass

    def go(self):
        pass

    def hear(self, _kind):
        return b""

    def values(self, _report):
        return dict.fromkeys(self.names, 0.0) | {"latency_us": 7}

    def say(self, kind, content):
        Desk.said.append(kind.encode() + content)

    def end(self):
        return {}


@pytest.mark.parametrize("name, armed", [("crazyflie-2.1-flow", 0), ("crazyflie-2.1-brushless", 1)])
def test_the_brushless_drone_alone_is_armed(monkeypatch, name, armed):
    monkeypatch.setattr(flight, "Board", Desk)
    result = flight.fly(Path("any.elf"), scenario.parse(HOVER, "hover"), vehicles.load(name), 1)
    arm = b"L" + struct.pack("<BBB", 0, 3, 9 << 4 | 3 << 2 | 1) + b"\x01\x01"
    assert Desk.said.count(arm) == armed
    assert result.table.shape[1] == flight.COLUMNS and result.latency_us == 7
    assert result.table[-1, flight.TRUE_X:flight.TRUE_X + 2] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_reports_belong_to_crossings_of_their_kind_one_to_one():
    crossed = [(5.0, "entry"), (8.0, "exit"), (12.0, "entry")]
    late = height.delays(crossed, [(6.0, "entry"), (6.5, "entry"), (8.5, "entry"), (12.3, "exit"), (14.6, "entry")])
    assert late == pytest.approx([1.0]), "an entry for an exit, a second report and one too late are false"


def leg(**given):
    return height.Leg(**{"ending": "ok", "low_m": 0.7, "high_m": 0.9, "crossed": [], "reported": [], "end_m": 0.4,
                         "own_end_m": 0.0, "latency_us": 77} | given)


def test_a_summary_counts_flights_edges_and_false_reports():
    crossed = [(5.0, "entry"), (8.0, "exit")]
    legs = [leg(low_m=0.6, crossed=crossed, reported=[(5.5, "entry"), (10.0, "exit")]),
            leg(ending="it turned over after 3 s", high_m=1.9, crossed=crossed, reported=[(1.0, "exit")])]
    assert height.summary(legs) == ("1 of 2 ended well, 0.60 to 1.90 m; detected 2 of 4 (1 within 1.5 s), 0.5 to 2.0 s "
                                    "late; 1 false")
    assert height.summary([leg()]) == "1 of 1 ended well, 0.70 to 0.90 m; detected 0 of 0; 0 false"


def test_flights_that_were_kept_are_not_flown_again(monkeypatch, tmp_path, capsys):
    seeds = []

    def fly(_elf, _scenario, _vehicle, seed, **_options):
        seeds.append(seed)
        table = np.zeros((3, flight.COLUMNS))
        table[:, flight.T] = 5.0
        return flight.EmulatedFlight(table=table, edges=[(5.0, "entry", 0.1)])

    monkeypatch.setattr(height, "fly", fly)
    elf = tmp_path / "board.elf"
    elf.write_bytes(b"one")
    assert height.report(elf, seeds=2, only="flat", folder=tmp_path / "flights") and seeds == [1, 1, 2, 2]
    first = capsys.readouterr().out
    assert height.report(elf, seeds=2, only="flat", folder=tmp_path / "flights") and seeds == [1, 1, 2, 2]
    assert capsys.readouterr().out == first
    elf.write_bytes(b"another")
    height.report(elf, seeds=1, only="flat", folder=tmp_path / "flights")
    assert seeds == [1, 1, 2, 2, 1, 1], "another image flies anew"


def test_a_case_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(AirTouchError, match="no case begins with 'slope'; --only is the beginning of one of: platform"):
        height.report(tmp_path / "board.elf", only="slope")


def test_a_ramp_is_not_why_the_drone_comes_back_beside_its_start():
    """The mission flies velocities, so what sensors and wind are off by adds up: as much over a flat floor."""
    scenes = [missions.mission(next(case for case in missions.CASES if case.name.startswith(name)))
              for name in ("flat floor", "ramp")]
    flat, ramp = (np.array([side_by_side.own_loop(scene, compare.vehicle(), seed)[-1, log_row.POSITION]
                            for seed in range(1, 7)]) for scene in scenes)
    assert side_by_side.rms([flat]) > 0.2 and np.abs(ramp - flat).max() < 0.1


def test_both_loops_draw_the_same_noise(plant):
    """After the seconds on the floor the IMU's random numbers stand where they do in the emulated flight."""
    hover = scenario.parse(HOVER, "hover")
    own = side_by_side.own_loop(hover, compare.vehicle(), 1)
    assert own.shape == (len(draw_flight(hover, 1, 0).setpoints), log_row.COLUMNS)
    assert own[0, log_row.T] == pytest.approx(flight.BOOT_S) and own[-1, log_row.POSITION + 2] > 0.4


def test_loops_apart_by_an_offset_and_by_other_noise():
    own = np.zeros((100, log_row.COLUMNS))
    table = np.zeros((120, flight.COLUMNS))
    table[:, flight.T] = 0.01 * np.arange(-10, 110)
    table[:, flight.TRUE_X + 2] = 0.3
    table[:, flight.MOTOR] = 1000.0 * (-1.0) ** np.arange(120)
    pair = side_by_side.together(flight.EmulatedFlight(table=table), own, 0.2, 0.5)
    assert [len(part) for part in pair] == [30, 30] and pair[0][0, flight.T] == pytest.approx(0.2)
    other = own[:30].copy()
    other[:, log_row.PWM] = 5.0
    rows = {row.channel: row for row in side_by_side.differences([pair, (pair[0], other)])}
    assert (rows["z, m"].loops, rows["z, m"].emulated, rows["z, m"].draws) == pytest.approx((0.3, 0.0, 0.0))
    assert rows["motor 1, PWM"].emulated == pytest.approx(1000.0) and rows["motor 1, PWM"].draws == pytest.approx(5.0)
    assert rows["motor 2, PWM"].loops == 0.0 and np.isnan(side_by_side.differences([pair])[0].draws)
    rows = {row.channel: row for row in side_by_side.differences([pair], [other])}
    assert rows["motor 1, PWM"].draws == pytest.approx(5.0) and rows["motor 1, PWM"].own == 0.0


def test_traces_are_written_side_by_side_and_not_over_others(tmp_path):
    own = np.zeros((50, log_row.COLUMNS))
    table = np.ones((50, flight.COLUMNS))
    side_by_side.write_traces(tmp_path / "traces.csv", flight.EmulatedFlight(table=table), own)
    head, *rows = (tmp_path / "traces.csv").read_text().splitlines()
    assert head.startswith("t_s,x m emulated,x m own,") and len(rows) == 50
    assert rows[0].split(",")[:3] == ["1", "1", "0"] and len(head.split(",")) == len(rows[0].split(","))
    with pytest.raises(AirTouchError, match="exists already; use --force"):
        side_by_side.write_traces(tmp_path / "traces.csv", flight.EmulatedFlight(table=table), own)


@pytest.mark.slow
def test_the_firmware_flies_and_the_app_changes_no_command(image):
    scene = scenario.parse(HOVER, "hover")
    on, off, repeat = (flight.fly(image, scene, compare.vehicle(), 1, app=app, whole_milliseconds=True)
                       for app in (True, False, True))
    assert on.ending == off.ending == "ok"
    hover = on.table[-100:]
    assert np.abs(hover[:, 3] - 0.5).max() < 0.12 and np.abs(hover[:, 1:3]).max() < 0.3
    assert compare.differing(on, off)[:2] == (0, len(off.pwm)) and len(on.pwm) == len(off.pwm)
    assert (on.pwm == repeat.pwm).all() and on.pwm.max() > 20_000
    assert on.late == 0 and min(on.free_words.values()) > 0


@pytest.mark.slow
def test_the_height_is_kept_over_a_platform_where_it_is_asked_for(image):
    case = missions.CASES[0]
    low, high = height.height_range(flight.fly(image, missions.mission(case), compare.vehicle(), 1,
                                       parameters={"atHeight.enable": 1}))
    assert 0.7 < low < high < 0.95
    stock = flight.fly(image, missions.mission(case), compare.vehicle(), 1)
    assert height.height_range(stock)[1] > 1.2, "the shipped firmware climbs"
