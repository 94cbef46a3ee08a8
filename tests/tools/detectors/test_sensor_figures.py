"""The figures of a missing sensor: only of flights that the model did not know, and of every sensor."""

import json
import re
import sys

import pytest

from airtouch.cli import airtouch
from airtouch.detector.shared import sensors
from airtouch.errors import AirTouchError
from tools.detectors import sensor_figures

SCORE = {"edges": 180, "missed": 0.0123456, "false_per_minute": 0.04, "mean_abs_error_s": 0.0633333, "hit": {}}


@pytest.fixture
def score(tmp_path):
    """score(**more) -> the path of a score's JSON."""
    def write(**more):
        path = tmp_path / "score.json"
        path.write_text(json.dumps({**SCORE, **more}))
        return path
    return write


def write(monkeypatch, out, *pairs):
    monkeypatch.setattr(sys, "argv", ["sensor_figures.py", *pairs, "--out", str(out)])
    sensor_figures.main()


def test_the_help_names_options_that_there_are():
    known = {name for command in ("crossval", "evaluate") for option in airtouch.get_command(None, command).params
             for name in option.opts}
    assert set(re.findall("--[a-z-]+", sensor_figures.__doc__)) <= known


def test_the_notes_have_the_figures_that_they_name(score):
    assert sensor_figures.figures(score(), "folds") == {
        "of": "folds", "edges": 180, "missed": 0.0123, "false_per_minute": 0.04, "mean_abs_error_s": 0.0633}


def test_flights_that_the_model_knew_are_refused(score):
    with pytest.raises(AirTouchError, match="was trained on these flights") as error:
        sensor_figures.figures(score(in_training=["f.csv"]), "folds")
    assert "not the JSON" not in str(error.value)


def test_another_file_is_refused(tmp_path):
    (tmp_path / "x.json").write_text("[]")
    for name in ("x.json", "none.json"):
        with pytest.raises(AirTouchError, match="not the JSON"):
            sensor_figures.figures(tmp_path / name, "folds")


def test_each_sensor_has_its_figures(score, tmp_path, monkeypatch):
    pairs = [f"{name}={score()}={name} flights" for name in ("all", *sensors.SENSORS)]
    write(monkeypatch, tmp_path / "out.json", *pairs)
    content = json.loads((tmp_path / "out.json").read_text())
    assert {name: entry["of"] for name, entry in content.items()} == {
        name: f"{name} flights" for name in ("all", *sensors.SENSORS)}
    with pytest.raises(AirTouchError, match="needed: all"):
        write(monkeypatch, tmp_path / "other.json", *pairs[1:])
    assert not (tmp_path / "other.json").exists()
