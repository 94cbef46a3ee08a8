"""The flights of `airtouch gap demo`, from a stand-in for the simulator."""

import sys
import tomllib

import pytest

from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.gap import example
from airtouch.logs.flight_log import FlightLog
from made_flight import made_flight
from tools.simulation import gap_example


def flown(scene, count, seed, effects=(), workers=1):
    """Flights whose file says what the simulator alone knows."""
    for i in range(count):
        log = made_flight(seed + i, n=300)
        yield FlightLog({**log.columns, "rpm_1": log["t_s"]}, {
            **log.meta, "vehicle": "crazyflie-2.1", "acc_frame": "body", "effects": str(effects), "scene": scene})


def test_neither_the_effect_nor_what_only_a_simulator_knows_is_in_the_flights(tmp_path, monkeypatch):
    monkeypatch.setattr(gap_example.batch, "flights", flown)
    monkeypatch.setattr(sys, "argv", ["gap_example.py", str(tmp_path / "new")])
    gap_example.main()
    files = sorted(path.name for path in (tmp_path / "new").iterdir())
    assert files == sorted([example.ANSWER, *(f"nominal_{i}.csv.gz" for i in range(4)), "real.csv.gz"])
    for path in (tmp_path / "new").glob("*.csv.gz"):
        log = logs.read(path)
        assert "rpm_1" not in log.columns and "m1_pwm" in log.columns and len(log) == 300
        assert not {"effects", "scene"} & set(log.meta) and "weak_motor" not in str(log.meta)
    assert tomllib.loads((tmp_path / "new" / example.ANSWER).read_text())["effects"] == gap_example.EFFECT


def test_a_flight_that_diverges_ends_it(tmp_path, monkeypatch):
    monkeypatch.setattr(gap_example.batch, "flights", lambda *_, **__: ["fell down"])
    monkeypatch.setattr(sys, "argv", ["gap_example.py", str(tmp_path)])
    with pytest.raises(AirTouchError, match="nominal_0: fell down"):
        gap_example.main()


def test_the_package_holds_what_the_tool_makes():
    answer = tomllib.loads((example.FOLDER / example.ANSWER).read_text())
    assert answer["effects"] == gap_example.EFFECT
    assert not any(name.startswith(gap_example.DROPPED) for name in logs.read(example.FOLDER / "real.csv.gz").columns)
