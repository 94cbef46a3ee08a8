"""The commands without a drone: what they ask for, and what they refuse in one line."""

import re
import signal
import threading
from importlib import resources
from unittest.mock import Mock

import pytest
from click.testing import CliRunner

from airtouch import vehicle
from airtouch.cli import airtouch
from airtouch.cli.drone import collect as cli_collect
from airtouch.crazyflie import collect, mission, readiness, recorder
from airtouch.crazyflie.checks import Condition
from airtouch.errors import AirTouchError
from airtouch.logs.files import no_empty_folders


def run(*arguments):
    return CliRunner().invoke(airtouch, [str(a) for a in arguments])


def refusal(*arguments):
    result = run(*arguments)
    assert isinstance(result.exception, AirTouchError), result.output
    assert "\n" not in str(result.exception)
    return str(result.exception)


def test_collect_wants_a_drone_and_a_mission(tmp_path):
    assert "give --uri and --mission" in refusal("collect", "--out", tmp_path)
    assert "no mission 'loop'" in refusal("collect", "--out", tmp_path, "--uri", "udp://127.0.0.1:1", "--mission",
                                          "loop")
    assert "--flights must be" in refusal("collect", "--out", tmp_path, "--uri", "x", "--mission", "sweep", "-n", "0")
    assert "group.name=value" in refusal("collect", "--out", tmp_path, "--uri", "x", "--mission", "sweep", "--param",
                                         "a")


def test_without_a_drone_no_empty_folder_stays(tmp_path, monkeypatch):
    def nobody(*_, **__):
        raise AirTouchError("nobody answers")

    monkeypatch.setattr("airtouch.crazyflie.connection.drone.Drone", nobody)
    (tmp_path / "mine").mkdir()
    for out in (tmp_path / "flights", tmp_path / "mine" / "a" / "b", tmp_path / "mine"):
        assert refusal("collect", "--out", out, "--uri", "x", "--mission", "sweep") == "nobody answers"
    assert list(tmp_path.rglob("*")) == [tmp_path / "mine"]


@pytest.mark.parametrize("text, reason", [(None, "no such vehicle file"), ("mas_kg = 1.0", "unknown key mas_kg")])
def test_a_vehicle_that_cannot_be_loaded_is_told_before_connecting(tmp_path, monkeypatch, text, reason):
    monkeypatch.setattr("airtouch.crazyflie.connection.drone.Drone", Mock(side_effect=AssertionError("connected")))
    flown = ("collect", "--out", tmp_path / "flights", "--uri", "x", "--mission", "sweep", "--vehicle")
    assert "'crazyflie-2.1-flwo'" in refusal(*flown, "crazyflie-2.1-flwo")
    if text:
        (tmp_path / "mine.toml").write_text(text)
    assert reason in refusal(*flown, tmp_path / "mine.toml")
    assert not (tmp_path / "flights").exists()


@pytest.mark.parametrize("named", ["mine.toml", "crazyflie-2.1"])
def test_the_log_names_a_vehicle_that_is_found_from_any_folder(tmp_path, monkeypatch, named):
    (tmp_path / "mine.toml").write_text((resources.files("airtouch") / "vehicles" / "crazyflie-2.1.toml").read_text())
    (tmp_path / "elsewhere").mkdir()
    plans = []
    monkeypatch.setattr(cli_collect, "_fly", lambda plan, *_, **__: plans.append(plan) or True)
    monkeypatch.chdir(tmp_path)
    assert run("collect", "--out", "flights", "--uri", "x", "--mission", "sweep", "--vehicle", named).exit_code == 0
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert vehicle.of_log({"vehicle": plans[0].vehicle}) == (vehicle.load("crazyflie-2.1"), None)


def test_a_folder_that_holds_something_stays(tmp_path):
    with no_empty_folders(tmp_path / "a" / "b"):
        collect.prepare_folder(tmp_path / "a" / "b", print)
        (tmp_path / "a" / "b" / "flight.csv.gz.part").write_text("t_s")
    assert (tmp_path / "a" / "b" / "flight.csv.gz.part").is_file()


@pytest.mark.parametrize("number", [3, 4])
def test_an_existing_flight_is_not_flown_over(tmp_path, number):
    path = recorder.flight_path(tmp_path, "sweep", number)
    path.write_bytes(b"mine")
    message = refusal("collect", "--out", tmp_path, "--uri", "x", "--mission", "sweep", "--number", "3", "-n", "2")
    assert message == f"{path}: exists already; use --force to replace it" and path.read_bytes() == b"mine"


@pytest.fixture
def ctrl_c():
    """Ctrl-C as in a terminal: a shell starts what runs in the background with it ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_at_the_question_ends_the_program_before_anything_is_armed(tmp_path, monkeypatch):
    flown = Mock()
    monkeypatch.setattr("airtouch.crazyflie.connection.drone.Drone", Mock())
    monkeypatch.setattr(readiness, "make_ready", Mock())
    monkeypatch.setattr(collect, "fly", flown)
    monkeypatch.setattr("click.confirm", lambda *_, **__: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        cli_collect._fly(collect.Plan("x", tmp_path, "hop"), {1: Mock(seconds=1.0)}, tmp_path, ask=True)
    flown.assert_not_called()


def test_the_room_that_is_printed_is_that_of_the_flights_flown(tmp_path, monkeypatch):
    """The values of each flight are drawn: where it goes is what the pilot gets."""
    printed = r"x (\S+) to (\S+) m ahead, y (\S+) to (\S+) m to the left, up to (\S+) m high"
    flown = []

    def fly(drone, ready, mission, plan, number, **_):
        flown.append(mission)
        print(f"flown: {max(leg.x_m for leg in mission.legs):.1f} m")
        return Mock(planned=True)

    monkeypatch.setattr("airtouch.crazyflie.connection.drone.Drone", Mock())
    monkeypatch.setattr(readiness, "make_ready", Mock())
    monkeypatch.setattr(collect, "fly", fly)
    monkeypatch.setattr(cli_collect, "_report", Mock())
    output = run("collect", "--out", tmp_path, "--uri", "x", "--mission", "paper-9cm", "-n", "6", "--yes").output
    whole, *of_each = [re.search(printed, line) for line in output.splitlines() if re.search(printed, line)]
    distances = [max(leg.x_m for leg in one.legs) for one in flown]
    assert max(distances) - min(distances) > 0.5
    assert [float(found[2]) for found in of_each] == pytest.approx(distances, abs=0.05)
    assert float(whole[2]) == pytest.approx(max(distances), abs=0.05)
    assert float(whole[5]) == pytest.approx(max(leg.z_m for one in flown for leg in one.legs), abs=0.005)
    assert all(output.index(found[0]) < output.index(f"flown: {x:.1f}")
               for found, x in zip(of_each, distances, strict=True))


def fly_once(tmp_path, drone, stop):
    ready = readiness.Readiness(Condition(4.0, {"bcFlow2": True}), None, "unknown")
    flown = mission.load("sweep")
    return collect.fly(drone, ready, flown, collect.Plan("x", tmp_path, "hop"), 1, stop=stop, say=print)


@pytest.mark.parametrize("when", ["before", "while it settles"])
def test_a_stop_before_the_take_off_leaves_the_drone_unarmed(tmp_path, monkeypatch, when):
    drone, stop = Mock(protocol=8), threading.Event()
    standing = Mock(latest={"vbat_V": 4.0, "zrange_m": 0.02}, supervisor=readiness.CAN_BE_ARMED)
    monkeypatch.setattr(readiness, "listen", lambda *_: standing)
    monkeypatch.setattr(readiness, "reset_estimator", lambda _: stop.set())
    if when == "before":
        stop.set()
    with pytest.raises(AirTouchError, match="stopped by the user before the take-off"):
        fly_once(tmp_path, drone, stop)
    drone.arm.assert_not_called()
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_opened_leaves_the_drone_unarmed(tmp_path, monkeypatch):
    (tmp_path / "hop_0001.csv.gz.part").write_text("of a killed flight")
    settle = Mock()
    monkeypatch.setattr(collect, "settle", settle)
    with pytest.raises(AirTouchError, match="collect --recover, or remove it"):
        fly_once(tmp_path, Mock(protocol=8), threading.Event())
    settle.assert_not_called()


def test_a_folder_without_room_or_rights_is_told_before_flying(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    with pytest.raises(AirTouchError, match="cannot make this folder"):
        collect.prepare_folder(tmp_path / "file" / "out", print)
    monkeypatch.setattr(collect.shutil, "disk_usage", lambda _: type("usage", (), {"free": 10 * 2**20}))
    with pytest.raises(AirTouchError, match="10 MB of room left, 50 are needed"):
        collect.prepare_folder(tmp_path, print)


def test_missions_are_listed(tmp_path):
    result = run("collect", "--list-missions", "--out", tmp_path)
    assert result.exit_code == 0
    assert [line.split(":")[0] for line in result.output.splitlines()] == ["sweep", "there-and-back", "zig-zag"]


def test_nothing_to_recover_is_no_fault(tmp_path):
    assert run("collect", "--recover", "--out", tmp_path).exit_code == 0
    (tmp_path / "a_0001.csv.gz.part").write_text("")
    result = run("collect", "--recover", "--out", tmp_path)
    assert result.exit_code == 2 and "a_0001.csv.gz.part" in result.output


def test_replay_takes_one_flight(tmp_path):
    assert "no such file" in refusal("replay", tmp_path / "none.csv")
    (tmp_path / "a.csv").write_text("t_s,m1_pwm\n0,1\n")
    assert "give one flight, not a folder" in refusal("replay", tmp_path)
