"""The manifest of a folder of flights: what a flight counts as, and its row."""

import csv
import json
import re
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from airtouch.cli import airtouch
from airtouch.cli.drone.collect import _report
from airtouch.crazyflie import manifest
from airtouch.crazyflie.collect import Outcome, prepare_folder
from airtouch.detector.evaluation.evaluate import truth
from airtouch.errors import AirTouchError
from airtouch.logs import read, write
from airtouch.logs.flight_log import PWM, FlightLog

HEADER = "file,use,fold,height,angle_deg,wind,speed_mps"


def flight(lost=0, zrange=None, **meta) -> FlightLog:
    """Two hundred samples in cruise; zrange: its down range, m."""
    columns = {"t_s": np.arange(200) / 100}
    if zrange is not None:
        columns["zrange_m"] = zrange
    return FlightLog(columns, {"lost_samples": lost, **meta})


def over_a_platform(height_m: float = 0.4) -> np.ndarray:
    """A down range of 0.8 m, and less over a platform in the middle."""
    return np.where(np.arange(200) // 50 % 4 == 1, 0.8 - height_m, 0.8)


@pytest.mark.parametrize("lost_samples, zrange, planned, use", [
    (0, over_a_platform(), True, "clean"),
    (0, np.full(200, 0.8), True, "free-air"),
    (0, over_a_platform(0.05), True, "free-air"),  # an unevenness of the floor
    (0, over_a_platform(0.2), True, "messy"),  # the effect of a platform, but no true edge
    (0, None, True, "clean"),  # nothing says that there was no edge
    (0, over_a_platform(), False, "messy"),
    (2, over_a_platform(), True, "clean"),  # 2 of 202
    (3, over_a_platform(), True, "messy"),  # 3 of 203: more than 1 %
])
def test_use_of_a_flight(lost_samples, zrange, planned, use):
    assert manifest.use_of(flight(lost_samples, zrange), planned) == use


def light_flight(folder, vehicle) -> Path:
    """A log of a drone that hovers at a PWM of 11,000, and takes off at 17,000, over a platform of 0.4 m."""
    time = 0.01 * np.arange(2000)
    pwm = np.where((time > 1) & (time < 19), 11000.0, 0.0)
    pwm[(time > 1) & (time < 1.8)] = 17000.0
    height = np.interp(time, [1, 3, 16, 18.5], [0.0, 0.8, 0.8, 0.0]) - 0.4 * ((time > 8) & (time < 12))
    columns = {"t_s": time, "zrange_m": height} | dict.fromkeys(PWM, pwm)
    log = FlightLog(columns, {"lost_samples": 0, "vehicle": vehicle})
    write(log, folder / "light.csv")
    return folder / "light.csv"


def test_a_flight_is_in_the_air_from_its_own_vehicles_arm_pwm_on(tmp_path):
    """A vehicle file of one's own, as flash.md has it; without one the level is 15,000, the Crazyflie's."""
    text = (resources.files("airtouch") / "vehicles/crazyflie-2.1-brushless.toml").read_text()
    (tmp_path / "mine.toml").write_text(re.sub(r"(?m)^arm_pwm = \d+", "arm_pwm = 8000", text))
    for vehicle, use, edges in ((str(tmp_path / "mine.toml"), "clean", ["entry", "exit"]), ("", "free-air", []),
                                ("unknown", "free-air", [])):
        path = light_flight(tmp_path, vehicle)
        log = read(path)
        assert manifest.use_of(log, planned=True) == use
        assert [edge.kind for edge in truth(log)] == edges
        result = CliRunner().invoke(airtouch, ["logs", "check", str(path), "--json"])
        assert result.exit_code == 0 and [e["kind"] for e in json.loads(result.stdout)["flights"][0]["edges"]] == edges
        path.unlink()


def test_the_reason_is_said_where_a_low_platform_makes_a_flight_messy(capsys, tmp_path):
    for height_m, low in ((0.2, True), (0.4, False), (0.0, False)):
        log = flight(zrange=over_a_platform(height_m), longest_gap_s=0.0)
        _report(Outcome(tmp_path / "a.csv", "as planned", log, use=manifest.use_of(log, planned=True)))
        assert ("listed as messy: the platform is higher than 0.12 m" in capsys.readouterr().out) == low


def test_a_row_has_the_values_of_its_mission_and_replaces_an_older_one(tmp_path):
    path = tmp_path / "manifest.csv"
    path.write_text(f"{HEADER},note\nold.csv,clean,1,h79,0,none,0.35,mine\nnew.csv,messy,,,,,,\n")
    log = flight(flight=7, speed_mps=0.3, condition={"clearance": 0.04, "angle": 30, "wind": "fan"})
    assert manifest.list_flight(tmp_path / "new.csv", log, planned=True) == "clean"
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows == [f"{HEADER},note".split(","), "old.csv,clean,1,h79,0,none,0.35,mine".split(","),
                    "new.csv,clean,2,40mm,30,fan,0.3,".split(",")]


def test_columns_of_the_user_stay_where_they_are(tmp_path):
    path = tmp_path / "manifest.csv"
    path.write_text("note,file,use\nmine,old.csv,clean\n")
    manifest.list_flight(tmp_path / "new.csv", flight(), planned=True)
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert path.read_text().startswith("note,file,use,fold,height,")
    assert [(row["note"], row["file"], row["use"]) for row in rows] == [("mine", "old.csv", "clean"),
                                                                        ("", "new.csv", "clean")]


def test_a_recorded_flight_without_mission_leaves_its_values_empty(tmp_path):
    manifest.list_flight(tmp_path / "a.csv", flight(), planned=True)
    assert (tmp_path / "manifest.csv").read_text() == f"{HEADER}\na.csv,clean,0,,,none,\n"


@pytest.mark.parametrize("content, message", [
    ("file,use,note\na.csv,clean,Gerät\n".encode("latin-1"), "manifest.csv: no text in UTF-8"),
    (b"file,use\na.csv,clean\nb.csv,clean,windy, from the left\n", "manifest.csv:3: more cells than columns"),
])
def test_a_manifest_to_which_no_flight_can_be_added_is_refused_before_the_take_off(tmp_path, content, message):
    (tmp_path / "manifest.csv").write_bytes(content)
    with pytest.raises(AirTouchError, match=message):
        prepare_folder(tmp_path, lambda _: None)
    with pytest.raises(AirTouchError, match=message):
        manifest.list_flight(tmp_path / "new.csv", flight(), planned=True)
    assert (tmp_path / "manifest.csv").read_bytes() == content
