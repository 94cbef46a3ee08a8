"""`airtouch demo` from the outside, on few simulated flights and one epoch."""

import contextlib
import os
import re
import subprocess
import sys

import pytest
from click.testing import CliRunner

from airtouch.cli import demo
from airtouch.cli.shared import flights
from airtouch.detector import best
from airtouch.detector.evaluation.data import demo_flights
from airtouch.errors import AirTouchError
from made_flight import SMALL


def run(*arguments):
    return CliRunner().invoke(demo.command, [str(a) for a in arguments])


@pytest.mark.slow
def test_the_whole_of_it_without_recorded_flights(tmp_path, monkeypatch):
    pytest.importorskip("tensorflow", reason="training needs the extra 'train'")
    monkeypatch.setattr(demo, "find_flights", lambda: None)
    monkeypatch.setattr(demo_flights, "GENERATED", 8)
    monkeypatch.setattr(demo, "STEPS", SMALL.steps)
    monkeypatch.setattr(best, "Recipe", lambda: SMALL)
    out = tmp_path / "demo"
    result = run("--out", out, "--epochs", 1)
    assert result.exit_code == 0, result.output
    assert len(re.findall(r"^\[ *\d+ s\] \d\. ", result.output, re.M)) == 5
    assert "paper" in result.output and "baseline" in result.output and "false/min" in result.output
    assert (out / "report.html").stat().st_size > 100_000
    assert (out / "model" / "airtouch_model.c").exists() and (out / "model" / "paper.npz").exists()
    repeat = run("--out", out)
    assert isinstance(repeat.exception, AirTouchError) and "--force" in str(repeat.exception)


def test_a_model_of_the_user_is_not_replaced(tmp_path):
    pytest.importorskip("tensorflow", reason="training needs the extra 'train'")
    (tmp_path / "model").mkdir()
    (tmp_path / "model" / "best.npz").write_text("mine")
    assert "model: holds a model already" in str(run("--out", tmp_path).exception)
    assert len(list(tmp_path.iterdir())) == 1


def test_the_seconds_run_on_a_terminal_while_nothing_is_told():
    """On a pseudo-terminal: the elapsed time appears again and again, without a call."""
    code = ("import time\nfrom airtouch.cli.shared.progress import Bar\n"
            "with Bar('  flights '):\n    time.sleep(2.5)\n")
    master, slave = os.openpty()
    process = subprocess.Popen([sys.executable, "-c", code], stderr=slave, env={**os.environ, "TERM": "xterm"})
    os.close(slave)
    output = b""
    with contextlib.suppress(OSError):  # Linux ends a pseudo-terminal so
        while part := os.read(master, 4096):
            output += part
    os.close(master)
    assert process.wait() == 0
    assert {b"0:00:00", b"0:00:01", b"0:00:02"} <= set(re.findall(rb"\d:\d\d:\d\d", output))
    assert b"1/1" in output


def test_few_flights_are_too_few(generated, tmp_path):
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "f.csv").write_text("1,2\n")
    result = run("--out", tmp_path / "o", "--flights", tmp_path / "one")
    assert isinstance(result.exception, AirTouchError) and "too few" in str(result.exception)
    assert not (tmp_path / "o").exists()


def test_split_is_by_flight(generated, tmp_path):
    chosen = demo_flights.choose(generated, tmp_path)
    assert chosen.train and chosen.test and not {f.path for f in chosen.train} & {f.path for f in chosen.test}


def test_where_flights_are_looked_for(tmp_path, monkeypatch):
    monkeypatch.setenv("AIRTOUCH_FLIGHTS", str(tmp_path))
    assert flights.find_flights() == tmp_path
    (tmp_path / "airtouch").mkdir()
    (tmp_path / "airtouch" / "manifest.csv").write_text("file\n")
    assert flights.find_flights() == tmp_path / "airtouch"
    monkeypatch.setenv("AIRTOUCH_FLIGHTS", str(tmp_path / "none"))
    with pytest.raises(AirTouchError, match="no such folder"):
        flights.find_flights()


def test_the_folder_of_a_data_set_and_what_it_lacks(tmp_path, monkeypatch):
    monkeypatch.setenv("AIRTOUCH_FLIGHTS", str(tmp_path))
    folder = flights.data_folder("pad")
    assert folder == tmp_path / "pad" and flights.data_folder() == tmp_path
    with pytest.raises(AirTouchError, match="pad has no manifest.csv: give the folder"):
        flights.check_data_set(folder)
    folder.mkdir()
    (folder / "manifest.csv").touch()
    flights.check_data_set(folder)
    with pytest.raises(AirTouchError, match=r"no baselines\.csv"):
        flights.check_data_set(folder, "baselines.csv")
    monkeypatch.delenv("AIRTOUCH_FLIGHTS")
    (tmp_path / "shared" / "flights").mkdir(parents=True)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert flights.data_folder("pad") == tmp_path / "shared" / "flights" / "pad"
