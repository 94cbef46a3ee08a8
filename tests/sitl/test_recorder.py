"""The recording of a session: one log, whole or not at all."""

import time

import numpy as np
import pytest

import airtouch as at
from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import COLUMNS
from airtouch.sitl import Server, serve
from airtouch.sitl.recorder import Recorder

META = {"scenario": "sweep", "seed": 3, "sample_period_s": 0.01}


def test_rows_are_read_back_to_a_millionth(tmp_path):
    rows = np.random.default_rng(0).normal(size=(50, len(COLUMNS)))
    rows[:, 0] = 0.01 * np.arange(50)
    row = np.empty(len(COLUMNS))
    recorder = Recorder(tmp_path / "a.csv.gz", META, force=False)
    for values in rows:
        row[:] = values  # the caller's row is its own again after `add`
        recorder.add(row)
    assert not (tmp_path / "a.csv.gz").exists()
    recorder.write()
    log = logs.read(tmp_path / "a.csv.gz")
    assert np.abs(log.stack(COLUMNS) - rows).max() <= 0.5e-6 + 1e-12
    assert (log.meta["scenario"], log.meta["seed"], log.meta["sample_period_s"]) == ("sweep", 3, 0.01)


def test_a_recording_names_what_simulate_names(tmp_path):
    """But the drawn speed: how fast it flew the client knows, and `evaluate` would take the drawn one for it."""
    chosen = {"effects": {"wind": {"x": 0.5}}, "seed": 3}
    with serve("paper-4cm", port=0, speed=50.0, record=tmp_path / "a.csv", flight=2, **chosen) as sitl:
        while sitl.drone.ticks < 10:
            time.sleep(0.01)
    recorded, simulated = logs.read(tmp_path / "a.csv").meta, at.simulate("paper-4cm", flights=3, **chosen)[2].meta
    assert dict(recorded["effects"])["wind"]["x"] == 0.5
    for key in ("effects", "firmware", "range_module", "vehicle", "scenario", "seed", "flight"):
        assert recorded[key] == simulated[key], key
    assert {"speed": simulated["condition"]["speed"], **recorded["condition"]} == simulated["condition"]
    assert "speed" not in recorded["condition"]


def test_a_recording_names_the_faults_with_the_times_at_which_they_began(bench, tmp_path):
    """The battery's is a sample before that at which the logged voltage falls; one that never begins is not named."""
    craft = bench("hover", faults=["low-battery=1", "loss=0.3,all", "gap8-silent=99"], record=tmp_path / "a.csv")
    assert craft.high_level("<BBff?f", 7, 0, 0.5, 0.0, True, 1.5) == 0
    for tick in range(300):
        if tick == 50:
            craft.server.order("late=50ms")
        craft.server.step(lambda _: None)
    craft.server.recorder.write()
    log = logs.read(tmp_path / "a.csv")
    before_fall = log["t_s"][np.argmin(np.diff(log["vbat_V"]))]
    first, ordered = log["t_s"][0], log["t_s"][50]
    assert log.meta["faults"] == [{"kind": "loss", "t_s": first, "amount": 0.3, "all_packets": True},
                                  {"kind": "late", "t_s": ordered, "amount": 0.05},
                                  {"kind": "low-battery", "t_s": before_fall}]


def test_a_session_without_rows_writes_nothing(tmp_path):
    Recorder(tmp_path / "a.csv.gz", META, force=False).write()
    assert not list(tmp_path.iterdir())


def test_an_existing_file_and_a_folder_that_cannot_be_made_are_refused_before_the_session(tmp_path):
    (tmp_path / "a.csv").write_text("mine")
    with pytest.raises(AirTouchError, match="exists already; use --force"):
        Recorder(tmp_path / "a.csv", {}, force=False)
    with pytest.raises(AirTouchError, match="a.csv: cannot be made"):
        Recorder(tmp_path / "a.csv" / "b.csv", {}, force=True)
    with pytest.raises(AirTouchError, match="is a folder"):
        Recorder(tmp_path, {}, force=True)
    Recorder(tmp_path / "a.csv", {}, force=True)
    assert (tmp_path / "a.csv").read_text() == "mine"  # replaced at the end alone


def test_a_recording_that_cannot_be_written_is_an_error_of_the_session(tmp_path):
    folder = tmp_path / "gone"
    folder.mkdir()
    with pytest.raises(AirTouchError, match=r"gone/a\.csv"), serve(port=0, speed=50.0, record=folder / "a.csv") as sitl:
        while sitl.drone.ticks < 10:
            time.sleep(0.01)
        folder.rmdir()


def test_an_error_while_it_serves_ends_the_session_with_it(monkeypatch):
    def fail(*_):
        raise RuntimeError("a bug")

    monkeypatch.setattr(Server, "step", fail)
    with pytest.raises(RuntimeError, match="a bug"), serve(port=0):
        time.sleep(0.1)
