"""The commands without a drone: what they ask for, and what they refuse in one line."""

import pytest
from click.testing import CliRunner

from airtouch.cli import airtouch
from airtouch.crazyflie import collect, recorder
from airtouch.errors import AirTouchError


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


def test_a_folder_that_holds_something_stays(tmp_path):
    with collect.no_empty_folders(tmp_path / "a" / "b"):
        collect.prepare_folder(tmp_path / "a" / "b", print)
        (tmp_path / "a" / "b" / "flight.csv.gz.part").write_text("t_s")
    assert (tmp_path / "a" / "b" / "flight.csv.gz.part").is_file()


def test_an_existing_flight_is_not_flown_over(tmp_path):
    path = recorder.flight_path(tmp_path, "sweep", 3)
    path.write_bytes(b"mine")
    message = refusal("collect", "--out", tmp_path, "--uri", "x", "--mission", "sweep", "--number", "3")
    assert message == f"{path}: exists already; use --force to replace it" and path.read_bytes() == b"mine"


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
