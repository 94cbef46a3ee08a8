"""What a new user types first, wrong and right: suggestions, checks before the work, what a score must pass on."""

import re

import numpy as np
import pytest
from click.testing import CliRunner

from airtouch import logs, vehicle
from airtouch.cli import COMMANDS, MEANT, airtouch
from airtouch.cli.gap.files import files_of
from airtouch.crazyflie import manifest, mission
from airtouch.crazyflie.view import board
from airtouch.detector import registry
from airtouch.detector.shared import sensors
from airtouch.errors import AirTouchError, unknown
from airtouch.logs.files import check_free
from airtouch.logs.flight_log import FlightLog
from airtouch.report import evaluation_figures as figures
from airtouch.report.style import GREEN
from airtouch.simulation import scenario
from airtouch.simulation.flight import refuse_off
from airtouch.sitl import faults


def run(*arguments):
    return CliRunner().invoke(airtouch, [str(a) for a in arguments])


@pytest.mark.parametrize(("typed", "nearest"), [
    (("evalute",), "evaluate"), (("gap", "diagnos"), "diagnose"), (("gap", "blind", "scroe"), "score"),
    (("logs", "chek"), "check"), (("simulat",), "simulate")])
def test_a_mistyped_command_gets_the_nearest(typed, nearest):
    result = run(*typed)
    assert result.exit_code == 2 and f"No such command '{typed[-1]}'; did you mean {nearest}" in result.output


def test_a_word_for_a_command_gets_the_commands_that_do_it():
    result = run("detect", "flight.csv")
    assert result.exit_code == 2 and "No such command 'detect'; did you mean map or evaluate?" in result.output
    for word, commands in MEANT.items():
        assert word not in COMMANDS
        for command in commands:
            assert run(*command.split(), "--help").exit_code == 0


def test_a_mistyped_mission_gets_the_nearest():
    with pytest.raises(AirTouchError, match="no mission 'swep'; did you mean sweep"):
        mission.scene_of("swep")


@pytest.mark.parametrize(("call", "typed", "message"), [
    (scenario.load, "zigzg", "no scenario 'zigzg'; did you mean zigzag"),
    (scenario.load, "swep", "no scenario 'swep'; did you mean sweep"),
    (vehicle.load, "crazyflie-21", "no vehicle 'crazyflie-21'; did you mean crazyflie-2.1"),
    (registry.get, "papr", "no detector 'papr'; did you mean paper"),
    (faults.parse, "los=0.3", "no fault 'los'; did you mean loss"),
    (lambda name: sensors.without(FlightLog({"t_s": np.zeros(3)}, {}), (name,)), "motor",
     "no sensor 'motor'; did you mean motors")])
def test_a_mistyped_name_gets_the_nearest(call, typed, message):
    with pytest.raises(AirTouchError) as error:
        call(typed)
    assert re.fullmatch(re.escape(message) + r".*\? \(known: .+\)", str(error.value))


def test_a_name_like_no_other_gets_all_of_them():
    assert str(unknown("sensor", "xyz", ("rates", "motors"), ", or none")) == \
        "no sensor 'xyz' (known: rates, motors, or none)"


def test_every_ready_mission_is_a_world_of_the_virtual_drone_with_an_edge_on_its_way():
    for name in mission.names():
        scene = mission.scene_of(name)
        assert scene.name == name and scenario.draw_flight(scene, 0, 0).world is not None


@pytest.mark.parametrize("line", [("gap", "measure", "{log}", "--report"), ("gap", "diagnose", "{log}", "--json"),
                                  ("evaluate", "{log}", "--json"), ("train", "{log}", "--out")])
def test_an_output_that_cannot_be_written_is_told_before_the_work(generated, tmp_path, line):
    (tmp_path / "file").write_text("")
    words = [w.replace("{log}", str(generated / "f0.csv.gz")) for w in line]
    for out in (tmp_path / "file" / "out.x", tmp_path):
        result = run(*words, out)
        assert result.exit_code != 0
        message = f"{result.exception} {result.output}"
        assert any(t in message for t in ("cannot be made", "is a folder", "is a directory")), message


def test_a_folder_is_no_flight_to_map(generated, tmp_path):
    result = run("map", generated, "--out", tmp_path / "map.geojson")
    assert isinstance(result.exception, AirTouchError) and "a folder; a map is of one flight" in str(result.exception)


def test_a_manifest_is_no_flight(generated):
    names = [p.name for p in files_of([f"{generated}/*"])]
    assert names == ["f0.csv.gz", "f1.csv.gz", "f2.csv.gz", "f3.csv.gz"]
    assert files_of([str(generated / "manifest.csv"), str(generated / "f0.csv.gz")]) == [generated / "f0.csv.gz"]
    with pytest.raises(AirTouchError, match="a list of flights, not a flight"):
        files_of([str(generated / "manifest.csv")])


def test_an_effect_that_is_off_cannot_be_switched_off(tmp_path):
    plan = scenario.draw_flight(scenario.load("paper-low"), 0, 0)
    refuse_off(plan, ["gust"])
    with pytest.raises(AirTouchError, match="--without slung_load: this scenario does not switch it on; on are .*gust"):
        refuse_off(plan, ["slung_load"])
    result = run("simulate", "diagnosis", "--out", tmp_path / "o", "--without", "gust")
    assert isinstance(result.exception, AirTouchError) and "does not switch it on" in str(result.exception)
    assert not (tmp_path / "o").exists()


def test_a_log_of_nothing_is_told_as_that(generated, tmp_path):
    log = logs.read(generated / "f0.csv.gz")
    nothing = {name: np.full(len(log), np.nan) for name in log.columns if name != "t_s"}
    logs.write(log.with_columns(nothing), tmp_path / "nan.csv")
    result = run("evaluate", tmp_path / "nan.csv", "--speed", "0.3", "--detector", "baseline")
    assert "nan.csv: nothing was logged: every value of every channel is missing" in result.output
    result = run("gap", "measure", tmp_path / "nan.csv")
    assert "nothing was logged" in str(result.exception)
    assert "nothing was logged" in run("logs", "check", tmp_path / "nan.csv").output


def test_a_score_passes_on_what_the_log_check_knows(generated, tmp_path):
    log = logs.read(generated / "f0.csv.gz")
    clock = log["t_s"].copy()
    clock[300:310] = clock[300:310][::-1]
    logs.write(log.with_columns({"t_s": clock}), tmp_path / "back.csv")
    contents = (tmp_path / "back.csv").read_bytes()
    (tmp_path / "cut.csv").write_bytes(contents[:-20])
    result = run("evaluate", tmp_path / "back.csv", tmp_path / "cut.csv", "--speed", "0.3", "--detector", "baseline",
                 "--json", tmp_path / "out.json")
    assert "the clock runs backwards 9 times" in result.output
    assert "cut off" in result.output, result.output
    assert "runs backwards" in (tmp_path / "out.json").read_text()


def test_recovered_flights_are_listed(generated, tmp_path):
    log = logs.read(generated / "f0.csv.gz")
    log = log.with_columns({}, mission="sweep", flight=7, speed_mps=0.3, condition={"clearance": 0.04})
    logs.write(log, tmp_path / "sweep_0007.csv")
    (tmp_path / "sweep_0007.csv").rename(tmp_path / "sweep_0007.csv.gz.part")
    recovered, _ = manifest.recover(tmp_path)
    assert [p.name for p in recovered] == ["sweep_0007.csv.gz"]
    assert (tmp_path / "manifest.csv").read_text().splitlines()[1] == "sweep_0007.csv.gz,messy,2,40mm,,none,0.3"


def test_the_link_says_that_it_waits_before_there_is_a_rate():
    assert str(board.Link()) == "waiting for data"
    assert str(board.Link(100.0)).startswith("100 Hz")


def test_each_detector_keeps_its_colour():
    colours = [figures.colour_of(n) for n in ("best", "paper", "baseline", "paper-stream")]
    assert len(set(colours)) == 4 and GREEN not in colours  # green is the truth's


@pytest.mark.parametrize("command", [
    ("twin", "FLIGHTS", "--out"), ("crossval", "FLIGHTS", "--out"), ("paper", "--quick", "--out"), ("demo", "--out"),
    ("gap", "blind", "make"), ("gap", "blind", "run"), ("simulate", "hover", "--out"),
    ("dataset", "fetch", "--from", ".", "--out"), ("logs", "convert", "FLIGHT", "--out"), ("gap", "demo", "--out")])
def test_a_folder_that_cannot_be_made_is_told_in_one_line(command, generated, tmp_path):
    """A file stands where the folder should be: refused before the work, with its name."""
    (tmp_path / "taken").write_text("a file")
    flight = next(iter(sorted(generated.glob("*.csv.gz"))))
    words = {"FLIGHTS": generated, "FLIGHT": flight}
    result = run(*[words.get(word, word) for word in command], tmp_path / "taken/out")
    assert isinstance(result.exception, AirTouchError), result.output
    assert str(tmp_path / "taken/out") in str(result.exception) and "\n" not in str(result.exception)
    assert "cannot be made" in str(result.exception)


def test_check_free_makes_the_folder(tmp_path):
    check_free(tmp_path / "a" / "b.json", False)
    assert (tmp_path / "a").is_dir()
