"""collect and monitor against the virtual Crazyflie, over UDP with cflib as it is."""

import os
import re
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from click.testing import CliRunner

from airtouch import logs
from airtouch.cli import airtouch
from airtouch.crazyflie import blocks, collect, mission
from airtouch.crazyflie.drone import Drone, drain
from airtouch.errors import AirTouchError
from airtouch.simulation import loop
from airtouch.sitl import serve
from airtouch.sitl.faults import Line, parse
from airtouch.sitl.variables import log_variables

SPEED = 4.0  #: drone seconds a second
HOP = """
name = "hop"
[values]
clearance = 0.04
speed = 0.4
[world]
room_m = [-2.0, 3.5, -2.0, 2.0]
[[platform]]
size_m = [0.6, 3.0]
centre_m = [1.1, 0.0]
top_m = 0.46
[mission]
control = "position"
step = [{ do = "wait", time_s = 0.5 }, { do = "take-off", height_m = 0.5, time_s = 1.5 }, { do = "hover", time_s = 1.5 },
        { do = "go", distance_m = 2.0, speed_mps = 0.4 }, { do = "hover", time_s = 0.5 }, { do = "land", time_s = 2.0 }]
"""


@pytest.fixture(scope="module")
def hop(tmp_path_factory):
    path = tmp_path_factory.mktemp("missions") / "hop.toml"
    path.write_text(HOP)
    return path


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("tables")


@pytest.fixture(autouse=True)
def short_waits(monkeypatch):
    monkeypatch.setattr("airtouch.crazyflie.collect.RESET_S", 0.2)
    monkeypatch.setattr("airtouch.crazyflie.flight.AFTER_S", 0.2)


def run(*arguments):
    return CliRunner().invoke(airtouch, [str(a) for a in arguments])


def fly(virtual, hop, cache, out, *more):
    return run("collect", "--uri", virtual.uri, "--mission", hop, "--out", out, "--cache", cache, "--yes",
               "--link-timeout", 15, *more)  # a busy machine may be silent for a while


def on_the_ground(virtual):
    """Whether it stands with its motors off, now or within the seconds that a busy machine may need for its last step."""
    until = time.monotonic() + 5.0
    while time.monotonic() < until:
        row = virtual.drone.row
        if height(virtual) < 0.1 and not row[loop.PWM:loop.PWM + 4].any() and not virtual.drone.info() >> 7 & 1:
            return True
        time.sleep(0.05)
    return False


def height(virtual):
    return virtual.drone.row[loop.PLACE + 2]


def test_sweeps_are_flown_logged_and_listed(hop, cache, tmp_path):
    with serve(hop, port=0, speed=SPEED, faults=("late=50ms",)) as virtual:
        shown = fly(virtual, hop, cache, tmp_path, "--param", "airtouch.detector=1", "--flights", "2", "--number", "4")
        assert shown.exit_code == 0, shown.output
        assert on_the_ground(virtual)
    assert logs.read(tmp_path / "hop_0005.csv.gz").meta["ended"] == "as planned"
    log = logs.read(tmp_path / "hop_0004.csv.gz")
    assert [e.kind for e in logs.true_edges(log)] == ["entry", "exit"] and shown.output.count("\ntrue ") >= 2
    assert set(np.round(np.diff(log["t_s"]), 3)) == {0.01}  # late packets are none lost
    assert log.meta["lost_samples"] == 0 and log.meta["mission"] == "hop" and log.meta["decks"][:2] == ["bcAI", "bcFlow2"]
    assert log.meta["settings"] == ["airtouch.detector=1"] and log.meta["acc_frame"] == "body"
    entry, leave = (e.sample for e in logs.true_edges(log))
    assert log["x_m"][leave] - log["x_m"][entry] == pytest.approx(0.6, abs=0.15)
    flying = logs.airborne(log)
    assert np.nanmedian(log["acc_z_mps2"][flying]) == pytest.approx(9.8, abs=0.3)
    assert np.isfinite(log.stack(("x_m", "roll_rad", "range_front_m"))[50:]).any(axis=0).all()
    listed = (tmp_path / "manifest.csv").read_text().splitlines()
    assert listed[1].startswith("hop_0004.csv.gz,clean,4,40mm,") and listed[1].endswith(",0.4")
    assert run("evaluate", tmp_path).exit_code == 0


def test_thirty_percent_packet_loss_of_everything(hop, cache, tmp_path):
    with serve(hop, port=0, speed=SPEED) as virtual:
        plan = collect.Plan(virtual.uri, tmp_path, "hop", guarded=False)
        drone = Drone(virtual.uri, cache)
        try:
            ready = collect.make_ready(drone, plan, lambda _: None)
            rng = np.random.default_rng(5)
            virtual._up, virtual._down = (Line([parse("loss=0.3,all")], rng) for _ in range(2))  # the radio gets bad now
            outcome = collect.fly(drone, ready, mission.load(hop), plan, 1, stop=threading.Event(), say=lambda _: None)
        finally:
            drone.close()
        assert outcome.planned and on_the_ground(virtual)
    log = logs.read(outcome.path)
    span = round((log["t_s"][-1] - log["t_s"][0]) / 0.01) + 1
    assert len(log) + log.meta["lost_samples"] == span and 0.2 < log.meta["lost_samples"] / span < 0.4
    assert "messy" in (tmp_path / "manifest.csv").read_text()


def test_a_connection_is_made_through_losses(hop, cache):
    with serve(hop, port=0, speed=SPEED, faults=("loss=0.05,all",)) as virtual:
        drone = Drone(virtual.uri, cache)
        try:
            drone.start(blocks.MOTION)
            assert drone.variables
        finally:
            drone.close()


def test_a_five_second_drop_in_mid_sweep(hop, cache, tmp_path):
    with serve(hop, port=0, speed=SPEED, faults=("disconnect=4,5s",)) as virtual:
        shown = fly(virtual, hop, cache, tmp_path, "--link-timeout", 3.0 / SPEED)
        assert shown.exit_code == 1 and "link lost" in shown.output, shown.output
        assert on_the_ground(virtual)
    log = logs.read(tmp_path / "hop_0001.csv.gz")
    assert log.meta["longest_gap_s"] >= 4.9 and "link lost" in log.meta["ended"]
    middle = int(np.argmax(np.diff(log["t_s"])))
    assert middle > 200 and len(log) - middle > 20  # before the drop and after it


def test_a_drop_after_which_the_drone_has_forgotten_its_log_blocks(hop, cache, tmp_path):
    with serve(hop, port=0, speed=SPEED, faults=(f"disconnect=4,{1.5 * SPEED:g}s",)) as virtual:
        shown = fly(virtual, hop, cache, tmp_path)
        assert shown.exit_code == 0 and "heard again" in shown.output, shown.output
        assert on_the_ground(virtual)
    assert logs.read(tmp_path / "hop_0001.csv.gz").meta["longest_gap_s"] > 4.0


def test_ctrl_c_lands_and_keeps_the_log(hop, cache, tmp_path):
    with serve(hop, port=0, speed=SPEED) as virtual:
        process = _start(virtual, hop, cache, tmp_path)
        _until(lambda: height(virtual) > 0.3)
        process.send_signal(signal.SIGINT)
        text = process.communicate(timeout=30)[0]
        assert process.returncode == 1 and "stopped by the user" in text, text
        assert on_the_ground(virtual)
    assert "stopped by the user" in logs.read(tmp_path / "hop_0001.csv.gz").meta["ended"]


def test_a_killed_process_leaves_its_rows_and_a_drone_that_lands(hop, cache, tmp_path):
    with serve(hop, port=0, speed=SPEED) as virtual:
        process = _start(virtual, hop, cache, tmp_path)
        _until(lambda: height(virtual) > 0.3)
        os.kill(process.pid, signal.SIGKILL)
        process.communicate()
        _until(lambda: on_the_ground(virtual))
    shown = run("collect", "--recover", "--out", tmp_path)
    assert shown.exit_code == 0 and "recovered: " in shown.output
    assert len(logs.read(tmp_path / "hop_0001.csv.gz")) > 100


def _start(virtual, hop, cache, out):
    return subprocess.Popen([sys.executable, "-c", "from airtouch.cli import main; main()", "collect", "--uri", virtual.uri, "--mission", str(hop),
                             "--out", str(out), "--cache", str(cache)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT, text=True)


def _until(condition, patience_s=30.0):
    until = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.02)


@pytest.mark.parametrize("setting, says", [
    ("airtouch.pFa=2", "airtouch.pFa = 2: out of range; the drone kept 0.5"),
    ("airtouch.enable=300", "out of range; the drone keeps it as uint8_t, 0 to 255"),
    ("airtouch.nothing=1", "no such parameter"), ("deck.bcFlow2=0", "read-only"),
])
def test_settings_that_the_drone_does_not_take(virtual_on_the_ground, hop, cache, tmp_path, setting, says):
    shown = fly(virtual_on_the_ground, hop, cache, tmp_path, "--param", setting)
    assert shown.exit_code != 0 and isinstance(shown.exception, AirTouchError) and says in str(shown.exception)
    assert on_the_ground(virtual_on_the_ground) and not list(tmp_path.glob("hop*"))


@pytest.fixture(scope="module")
def virtual_on_the_ground(hop):
    with serve(hop, port=0, speed=SPEED) as virtual:
        yield virtual


def test_a_rejected_log_block_says_why(virtual_on_the_ground, cache, monkeypatch):
    monkeypatch.setattr("cflib.crazyflie.log.Log.MAX_VARIABLES", 1000)  # so that it is the drone that refuses
    drone = Drone(virtual_on_the_ground.uri, cache)
    try:
        with pytest.raises(AirTouchError, match="rejected: .*memory for log blocks is full"):
            for number in range(12):
                drone.start(blocks.Block(f"filler{number}", 200, (("sys.canfly", "uint8_t"),) * 26))
    finally:
        drone.close()


def test_firmware_without_a_variable_is_told_which(hop, cache, tmp_path, monkeypatch):
    def fewer(drone):
        return {name: how for name, how in log_variables(drone).items() if name not in ("motor.m3", "pm.vbat")}

    monkeypatch.setattr("airtouch.sitl.firmware.variables.log_variables", fewer)
    with serve(hop, port=0, speed=SPEED) as virtual:
        shown = fly(virtual, hop, cache, tmp_path)
        assert "the firmware has no log variable motor.m3, pm.vbat" in str(shown.exception)
        assert on_the_ground(virtual)


def test_an_empty_battery_and_a_missing_deck_keep_it_on_the_ground(hop, cache, tmp_path):
    with serve(hop, port=0, speed=SPEED, faults=("low-battery=start",)) as virtual:
        shown = fly(virtual, hop, cache, tmp_path)
        assert "not ready: battery at" in str(shown.exception) and "charge it" in str(shown.exception)
        assert on_the_ground(virtual) and not list(tmp_path.glob("hop*"))


def test_a_gap8_that_never_answers_is_told_by_monitor(hop, cache):
    with serve(hop, port=0, speed=SPEED, faults=("gap8-silent=start",)) as virtual:
        shown = run("monitor", "--uri", virtual.uri, "--duration", "1.5", "--cache", cache,
                    "--param", "airtouch.detector=2")
    assert shown.exit_code == 0 and "the GAP8 does not answer" in shown.output, shown.output
    assert "the drone says: " in shown.output and "another detector runs" in shown.output and re.search(r"\d Hz, 0.0 % lost.*round trip", shown.output)


def test_monitor_counts_losses_and_runs_the_detector_here(hop, cache):
    with serve(hop, port=0, speed=SPEED, faults=("loss=0.3",)) as virtual:
        shown = run("monitor", "--uri", virtual.uri, "--duration", "1.5", "--cache", cache, "--host-detector")
    share = float(re.findall(r"([\d.]+) % lost", shown.output)[-1])
    assert shown.exit_code == 0 and 20 < share < 40 and "(best on the host)" in shown.output, shown.output
    assert "P 0.00" in shown.output


def test_nobody_at_the_address_is_one_line():
    with pytest.raises(AirTouchError, match="no connection: .*is the drone on"):
        Drone("udp://127.0.0.1:1", patience_s=0.5)
    with pytest.raises(AirTouchError, match="no connection"):
        Drone("nonsense", patience_s=0.5)


def test_an_interrupted_link_object_is_opened_again(virtual_on_the_ground, cache):
    drone = Drone(virtual_on_the_ground.uri, cache)
    try:
        drone.start(blocks.MOTION)
        drone.lost.set()
        drone.reopen(5.0)
        drain(drone.samples)
        time.sleep(0.5)
        stamps = [s.stamp for s in drain(drone.samples)]
        assert len(stamps) > 50 and not drone.lost.is_set() and set(np.diff(stamps)) == {10}
    finally:
        drone.close()
