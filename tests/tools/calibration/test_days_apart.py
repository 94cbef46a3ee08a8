"""How far days are apart: by the day of the manifest; far where the rotors shake more, near where nothing differs."""

import re
import sys

import pytest

from airtouch import logs
from airtouch import vehicle as vehicles
from airtouch.errors import AirTouchError
from airtouch.simulation.flight import fly
from airtouch.twin.recorded import missions
from skips import needs
from tools.calibration import days_apart
from twin_courses import PLAIN, made_course

pytestmark = needs("sklearn")


def write(folder, days, effects):
    """A folder of simulated flights with a manifest, one for each of `days`; effects: of the days that have some."""
    folder.mkdir()
    vehicle = vehicles.load("crazyflie-2.1-flow")
    rows = []
    for number, day in enumerate(days):
        log = fly(missions.scenario_of(made_course(number, 0.06), effects.get(day, PLAIN)), vehicle, 3, number)
        logs.write(log, folder / f"f{number}.csv.gz")
        rows.append(f"f{number}.csv.gz,{day},0.3\n")
    (folder / "manifest.csv").write_text("file,day,speed_mps\n" + "".join(rows))
    return folder


def table(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["days_apart.py", *map(str, arguments)])
    days_apart.main()
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in capsys.readouterr().out.splitlines()]
    return {row[0]: dict(zip(rows[0][2:], row[2:], strict=True)) for row in rows[2:]}


@pytest.mark.slow
def test_a_day_of_shaking_rotors_is_far_and_a_day_like_the_other_is_not(tmp_path, monkeypatch, capsys):
    shaking = PLAIN | {"motor_noise": {"rms": 0.02, "time": 0.2, "fast": 0.03}}
    folder = write(tmp_path / "flights", ["1", "2", "3"] * 8, {"3": shaking})
    scores = table(monkeypatch, capsys, folder, "--fewest", 6)
    assert set(scores) == {"two random halves", "1 against 2", "1 against 3", "2 against 3"}
    value, low, _ = (float(x) for x in re.findall(r"\d\.\d+", scores["1 against 3"]["hover"]))
    assert value > 0.95
    _, low, _ = (float(x) for x in re.findall(r"\d\.\d+", scores["1 against 2"]["hover"]))
    assert low < 0.6


def test_one_day_is_refused(tmp_path, monkeypatch, capsys):
    folder = write(tmp_path / "flights", ["1"], {})
    with pytest.raises(AirTouchError, match=r"two days with 4 flights.*1 1"):
        table(monkeypatch, capsys, folder)
