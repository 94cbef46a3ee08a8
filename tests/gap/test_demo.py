"""`airtouch gap demo`: the flights that come with the package, and what is found in them."""

import functools
import json

import pytest
from click.testing import CliRunner

import airtouch.gap.diagnosis as module
from airtouch import logs
from airtouch.cli.gap import command
from airtouch.errors import AirTouchError
from airtouch.gap import example
from airtouch.simulation.effects import EFFECTS

KEPT = ("weak_motor", "com_offset", "motor_noise")  #: candidates; the others take time


def test_the_flights_come_with_the_package_and_do_not_name_their_effect():
    flights = [logs.read(p) for p in (example.real(), *example.nominal())]
    assert len(flights) == 5 and all(len(f) > 1500 for f in flights)
    (name, values), = example.answer().items()
    assert EFFECTS[name].values(values)["thrust_loss"] == values["thrust_loss"]
    assert all(name not in str(f.meta) for f in flights)


@pytest.mark.slow
def test_the_withheld_effect_is_found_and_the_report_written(tmp_path, monkeypatch):
    diagnose_few = functools.partial(module.diagnose, without=[n for n in EFFECTS if n not in KEPT])
    monkeypatch.setattr(module, "diagnose", diagnose_few)
    demo = CliRunner().invoke(command, ["demo", "--out", str(tmp_path)])
    assert demo.exit_code == 0, demo.output
    diagnosis = json.loads((tmp_path / "diagnosis.json").read_text())
    assert diagnosis["effects"][0]["name"] == diagnosis["ranking"][0]["name"] == "weak_motor"
    assert diagnosis["effects"][0]["parameters"]["thrust_loss"]["value"] == pytest.approx(0.12, abs=0.02)
    assert diagnosis["effects"][0]["parameters"]["rotor"]["value"] == 2
    assert "found: weak_motor." in demo.output and (tmp_path / "report.html").read_text().startswith("<!DOCTYPE html>")
    repeat = CliRunner().invoke(command, ["demo", "--out", str(tmp_path)])
    assert isinstance(repeat.exception, AirTouchError) and "--force" in str(repeat.exception)
