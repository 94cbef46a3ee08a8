"""The detector for logs without acceleration: what it is trained on, by halves, and that it sees no acceleration."""

import sys

import numpy as np
import pytest

from airtouch import logs
from airtouch.detector import best
from airtouch.detector.evaluation import evaluate
from airtouch.detector.shared import sensors
from airtouch.errors import AirTouchError
from airtouch.simulation import scenario
from airtouch.twin import adapt, edge_strength, overlay
from airtouch.vehicle import load
from made_flight import SMALL, made_flight
from skips import needs
from tools.detectors import train_without_acceleration as tool


def test_flights_of_no_fold_are_trained_on(tmp_path):
    for i in range(3):
        logs.write(made_flight(i), tmp_path / f"f{i}.csv")
    assert len(tool.training_files([tmp_path], None)) == 3, "a folder without a manifest has no folds"
    (tmp_path / "manifest.csv").write_text("file,fold\nf0.csv,0\nf1.csv,1\nf2.csv,\n")
    assert len(tool.training_files([tmp_path], None)) == 3
    assert [f.path.name for f in tool.training_files([tmp_path], 1)] == ["f0.csv", "f2.csv"]


class Shortened(tuple):
    """(scenario, least share of a length), with the name and the table that a scenario has."""

    name, table = "short", scenario.load("hover").table


@pytest.fixture
def trained(tmp_path, monkeypatch):
    """Four synthetic flights in two folds, of which fold 1 is held out; what `best.fit` is asked for, and the model."""
    folder, scenes = tmp_path / "flights", []
    folder.mkdir()
    for i in range(4):
        logs.write(made_flight(i), folder / f"f{i}.csv")
    (folder / "manifest.csv").write_text("file,fold,speed_mps\n" + "".join(f"f{i}.csv,{i % 2},0.3\n" for i in range(4)))
    overlaid = [made_flight(20 + i) for i in range(6)]
    monkeypatch.setattr(best, "Recipe", lambda: SMALL)
    monkeypatch.setattr(scenario, "load", lambda path: str(path))
    monkeypatch.setattr(tool.vehicle, "load", lambda path: load())
    monkeypatch.setattr(tool, "shorten", lambda scene, least, seed: Shortened((scene, least)))
    monkeypatch.setattr(overlay, "simulate_responses", lambda scene, *_: scenes.append(scene) or [])
    monkeypatch.setattr(overlay, "free_air", lambda flights: flights)
    monkeypatch.setattr(overlay, "flights", lambda *_: (overlaid, [evaluate.truth(log) for log in overlaid]))
    monkeypatch.setattr(edge_strength, "strengths", lambda flights, weak: {})
    monkeypatch.setattr(adapt, "STEPS", {"scratch": 3})
    fit = best.fit
    monkeypatch.setattr(best, "fit", lambda flights, *a, **o: scenes.append((flights, o)) or fit(flights, *a, **o))
    out = tmp_path / "without.npz"
    monkeypatch.setattr(sys, "argv", ["tool", str(folder), "--twin", "twin", "--hold-out", "1", "--out", str(out)])
    tool.main()
    with pytest.raises(AirTouchError, match="--force"):
        tool.main()
    return scenes, best.load(out)


@needs("tensorflow")
def test_recorded_and_simulated_flights_have_half_each_and_no_acceleration(trained):
    ((scene, least), (flights, options)), model = trained
    assert scene == "twin/scenario.toml" and least == 0.3
    assert len(flights) == 2 + 6, "fold 1 is held out"
    assert sum(options["emphasis"][:2]) == pytest.approx(sum(options["emphasis"][2:]))
    assert all("acceleration" in sensors.missing_sensors(log) for log in flights)
    assert set(sensors.CHANNELS_OF["acceleration"]) <= set(model.recipe.muted)
    log = made_flight(3)
    shaken = log.with_columns({"acc_x_mps2": log["acc_x_mps2"] + np.sin(np.arange(len(log)))})
    assert np.array_equal(best.run(log, model).probability, best.run(shaken, model).probability)
