"""collect and monitor with cflib as it is and the virtual drone, in its own time."""

import io
import re
import struct
import threading
from contextlib import contextmanager

import numpy as np
import pytest
from click.testing import CliRunner

from airtouch import logs
from airtouch.cli import airtouch
from airtouch.crazyflie import collect, mission, readiness
from airtouch.crazyflie.connection import blocks
from airtouch.crazyflie.connection.drone import Drone, drain
from airtouch.crazyflie.guard import Guard
from airtouch.errors import AirTouchError
from airtouch.simulation.sensors import log_row
from airtouch.sitl.services.variables import log_variables

pytest.importorskip("cflib", reason="flying needs cflib")
from missions import HOP

from simulated_link import simulated


@pytest.fixture(scope="module")
def hop(tmp_path_factory):
    path = tmp_path_factory.mktemp("missions") / "hop.toml"
    path.write_text(HOP)
    return path


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("tables")


@pytest.fixture
def serve(hop, monkeypatch):
    """serve(fault, ...): the drone at the hop's start."""
    with monkeypatch.context() as patch:
        yield lambda *faults: simulated(patch, hop, faults=faults)


@pytest.fixture(autouse=True)
def guards(monkeypatch):
    """The guard of each flight; its process has tests of its own."""
    started = []

    @contextmanager
    def guarding(uri, height_m, seconds):
        started.append(Guard(io.BytesIO()))
        yield started[-1]

    monkeypatch.setattr(collect, "guarding", guarding)
    return started


def run(*arguments):
    return CliRunner().invoke(airtouch, [str(a) for a in arguments])


def fly(virtual, hop, cache, out, *more):
    return run("collect", "--uri", virtual.uri, "--mission", hop, "--out", out, "--cache", cache, "--yes", *more)


def comes_to_rest(virtual):
    """Whether it stands with its motors off, now or within a second."""
    def rests():
        row = virtual.drone.row
        return (row[log_row.POSITION + 2] < 0.1 and not row[log_row.PWM:log_row.PWM + 4].any()
                and not virtual.drone.info() >> 7 & 1)

    return virtual.clock.wait_for(rests, 1.0)


def test_sweeps_are_flown_logged_and_listed(serve, hop, cache, tmp_path, guards):
    with serve() as virtual:
        virtual.once_it_logs(lambda: virtual.order("late=50ms"))
        result = fly(virtual, hop, cache, tmp_path, "--param", "airtouch.detector=1", "--flights", "2", "--number", "4")
        assert result.exit_code == 0, result.output
        assert comes_to_rest(virtual)
    assert [guard.pipe.getvalue() for guard in guards] == [b"10", b"10"]
    assert logs.read(tmp_path / "hop_0005.csv.gz").meta["ended"] == "as planned"
    log = logs.read(tmp_path / "hop_0004.csv.gz")
    assert [e.kind for e in logs.true_edges(log)] == ["entry", "exit"] and result.output.count("\ntrue ") >= 2
    assert set(np.round(np.diff(log["t_s"]), 3)) == {0.01}  # late packets are none lost
    assert log.meta["lost_samples"] == 0 and log.meta["mission"] == "hop"
    assert log.meta["decks"][:2] == ["bcAI", "bcFlow2"]
    assert log.meta["settings"] == ["airtouch.detector=1"] and log.meta["acc_frame"] == "body"
    entry, leave = (e.sample for e in logs.true_edges(log))
    assert log["x_m"][leave] - log["x_m"][entry] == pytest.approx(0.6, abs=0.15)
    flying = logs.airborne(log)
    assert np.nanmedian(log["acc_z_mps2"][flying]) == pytest.approx(9.8, abs=0.3)
    assert np.isfinite(log.stack(("x_m", "roll_rad", "range_front_m"))[50:]).any(axis=0).all()
    listed = (tmp_path / "manifest.csv").read_text().splitlines()
    assert listed[1].startswith("hop_0004.csv.gz,clean,4,40mm,") and listed[1].endswith(",0.4")
    assert run("evaluate", tmp_path).exit_code == 0


def test_a_second_collect_starts_where_the_first_did(serve, hop, cache, tmp_path):
    with serve() as virtual:
        for number in (1, 2):  # the first lands behind the platform
            result = fly(virtual, hop, cache, tmp_path, "--number", str(number))
            assert result.exit_code == 0, result.output
            assert comes_to_rest(virtual) and virtual.drone.row[log_row.POSITION] > 1.5
    kinds = [[e.kind for e in logs.true_edges(logs.read(tmp_path / f"hop_000{n}.csv.gz"))] for n in (1, 2)]
    assert kinds == [["entry", "exit"]] * 2
    assert [row.split(",")[1] for row in (tmp_path / "manifest.csv").read_text().splitlines()[1:]] == ["clean"] * 2


def test_a_killed_flight_in_mid_air_is_followed_by_one_from_the_ground(serve, hop, cache, tmp_path):
    with serve() as virtual:
        virtual.drone.commander.planner.command(bytes([7, 0]) + struct.pack("<ff?ff", 0.5, 0.0, True, 0.0, 1.0),
                                                virtual.drone.now_s)
        virtual.clock.wait_for(lambda: virtual.drone.row[log_row.POSITION + 2] > 0.4, 5.0)
        result = fly(virtual, hop, cache, tmp_path)
        assert result.exit_code == 0, result.output
    log = logs.read(tmp_path / "hop_0001.csv.gz")
    assert log["zrange_m"][0] < 0.1 and log.stack(("m1_pwm", "m2_pwm"))[0].max() == 0.0


def test_a_flight_without_an_edge_is_free_air(serve, cache, tmp_path):
    path = tmp_path / "far.toml"
    path.write_text(HOP.replace('"hop"', '"far"').replace("distance_m = 2.0", "distance_m = 0.3"))
    with serve() as virtual:
        result = fly(virtual, path, cache, tmp_path)
        assert result.exit_code == 0, result.output
    assert (tmp_path / "manifest.csv").read_text().splitlines()[1].startswith("far_0001.csv.gz,free-air,")
    assert "no edge" in result.output


def test_thirty_percent_packet_loss_of_everything(serve, hop, cache, tmp_path):
    with serve() as virtual:
        plan = collect.Plan(virtual.uri, tmp_path, "hop")
        drone = Drone(virtual.uri, cache)
        try:
            ready = readiness.make_ready(drone, plan.settings, plan.least_v, lambda _: None)
            virtual.order("loss=0.3,all")  # the radio gets bad now
            outcome = collect.fly(drone, ready, mission.load(hop), plan, 1, stop=threading.Event(), say=lambda _: None)
        finally:
            drone.close()
        assert outcome.planned and comes_to_rest(virtual)
    log = logs.read(outcome.path)
    span = round((log["t_s"][-1] - log["t_s"][0]) / 0.01) + 1
    assert len(log) + log.meta["lost_samples"] == span and 0.2 < log.meta["lost_samples"] / span < 0.4
    assert "messy" in (tmp_path / "manifest.csv").read_text()


@pytest.mark.parametrize("seconds", [5.0, 7.3, 20.0])
def test_a_drop_in_mid_sweep_ends_in_a_landing(serve, hop, cache, tmp_path, guards, seconds):
    with serve(f"disconnect=4,{seconds:g}s") as virtual:
        result = fly(virtual, hop, cache, tmp_path)
        assert result.exit_code == 1 and "link lost" in result.output, result.output
        assert comes_to_rest(virtual) and guards[0].pipe.getvalue() == b"10"
    log = logs.read(tmp_path / "hop_0001.csv.gz")
    assert log.meta["longest_gap_s"] >= seconds - 0.1 and "link lost" in log.meta["ended"]
    middle = int(np.argmax(np.diff(log["t_s"])))
    assert middle > 200 and len(log) - middle > 20  # before the drop and after it
    down = np.flatnonzero(log["z_m"] > 0.1)[-1] - np.flatnonzero(log["z_m"] > 0.3)[-1]
    assert down > 30  # samples from 0.3 to 0.1 m; a fall takes some 13


def test_a_drop_after_which_the_drone_has_forgotten_its_log_blocks(serve, hop, cache, tmp_path):
    with serve("disconnect=4,6s") as virtual:
        result = fly(virtual, hop, cache, tmp_path, "--link-timeout", "15")
        assert result.exit_code == 0 and "heard again" in result.output, result.output
        assert comes_to_rest(virtual)
    assert logs.read(tmp_path / "hop_0001.csv.gz").meta["longest_gap_s"] > 4.0


@pytest.mark.parametrize("setting, message", [
    ("airtouch.pFa=2", "airtouch.pFa = 2: out of range; the drone kept 0.5"),
    ("airtouch.enable=300", "out of range; the drone keeps it as uint8_t, 0 to 255"),
    ("airtouch.nothing=1", "no such parameter"), ("deck.bcFlow2=0", "read-only"),
])
def test_settings_that_the_drone_does_not_take(serve, hop, cache, tmp_path, setting, message):
    with serve() as virtual:
        result = fly(virtual, hop, cache, tmp_path, "--param", setting)
        assert result.exit_code != 0 and isinstance(result.exception, AirTouchError)
        assert message in str(result.exception)
        assert comes_to_rest(virtual) and not list(tmp_path.glob("hop*"))


def test_a_setting_that_is_never_answered_is_told(serve, hop, cache, tmp_path):
    with serve() as virtual:
        drone = Drone(virtual.uri, cache)
        try:
            virtual.clock.wait_for(lambda: drone.crazyflie.param.is_updated)
            virtual.script = lambda packet, answers: []
            with pytest.raises(AirTouchError, match="airtouch.pFa: the drone did not answer; is the link good"):
                drone.set_parameter("airtouch.pFa", "0.1")
        finally:
            drone.close()


def test_firmware_without_a_variable_is_told_which(serve, hop, cache, tmp_path, monkeypatch):
    def fewer(drone):
        return {name: kind for name, kind in log_variables(drone).items() if name not in ("motor.m3", "pm.vbat")}

    monkeypatch.setattr("airtouch.sitl.firmware.variables.log_variables", fewer)
    with serve() as virtual:
        result = fly(virtual, hop, cache, tmp_path)
        assert "the firmware has no log variable motor.m3, pm.vbat" in str(result.exception)
        assert comes_to_rest(virtual)


def test_an_empty_battery_and_a_missing_deck_keep_it_on_the_ground(serve, hop, cache, tmp_path):
    with serve("low-battery=start") as virtual:
        result = fly(virtual, hop, cache, tmp_path)
        assert "not ready: battery at" in str(result.exception) and "charge it" in str(result.exception)
        assert comes_to_rest(virtual) and not list(tmp_path.glob("hop*"))


@pytest.mark.parametrize("option", ["--link-timeout", "--min-battery"])
@pytest.mark.parametrize("value", ["nan", "inf", "-1"])
def test_limits_that_are_never_reached_are_refused(tmp_path, option, value):
    out = tmp_path / "new"
    result = run("collect", "--uri", "udp://127.0.0.1:1", "--mission", "sweep", "--out", out, option, value)
    assert result.exit_code == 2 and option in result.output and not out.exists()


def test_a_flight_that_ends_by_an_error_is_listed_as_messy(serve, hop, cache, tmp_path):
    def show(flight):
        if flight.pilot.leg and flight.pilot.leg.kind == "go":
            raise RuntimeError("a bug")

    with serve() as virtual:
        plan = collect.Plan(virtual.uri, tmp_path, "hop")
        drone = Drone(virtual.uri, cache)
        try:
            ready = readiness.make_ready(drone, plan.settings, plan.least_v, lambda _: None)
            with pytest.raises(RuntimeError, match="a bug"):
                collect.fly(drone, ready, mission.load(hop), plan, 1, stop=threading.Event(), say=lambda _: None,
                            show=show)
        finally:
            drone.close()
        assert comes_to_rest(virtual)
    assert (tmp_path / "manifest.csv").read_text().splitlines()[1].startswith("hop_0001.csv.gz,messy,1,")
    assert logs.read(tmp_path / "hop_0001.csv.gz").meta["ended"] == "an error"


def test_a_gap8_that_never_answers_is_told_by_monitor(serve, cache):
    with serve("gap8-silent=start") as virtual:
        result = run("monitor", "--uri", virtual.uri, "--duration", "4", "--cache", cache, "--param",
                     "airtouch.detector=2")
    assert result.exit_code == 0 and "the GAP8 does not answer" in result.output, result.output
    assert "the drone says: " in result.output and "another detector runs" in result.output
    assert re.search(r"\d Hz, 0.0 % lost.*round trip", result.output)


def test_monitor_counts_losses_and_runs_the_detector_here(serve, cache):
    with serve("loss=0.3") as virtual:
        result = run("monitor", "--uri", virtual.uri, "--duration", "6", "--cache", cache, "--host-detector")
    assert result.exit_code == 0 and "(best on the host)" in result.output, result.output
    share = float(re.findall(r"([\d.]+) % lost", result.output)[-1])
    assert 20 < share < 40 and "P 0.00" in result.output


def test_an_interrupted_link_object_is_opened_again(serve, cache):
    with serve() as virtual:
        drone = Drone(virtual.uri, cache)
        try:
            drone.start(blocks.MOTION)
            drone.lost.set()
            drone.reopen(5.0)
            drain(drone.samples)
            virtual.clock.sleep(2.0)
            stamps = [s.stamp for s in drain(drone.samples)]
            assert len(stamps) == 200 and not drone.lost.is_set() and set(np.diff(stamps)) == {10}
        finally:
            drone.close()
