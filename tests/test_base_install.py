"""The base install detects, diagnoses and simulates: nothing on those paths asks for an extra."""

import subprocess
import sys

import pytest

import short_flights
from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.extras import EXTRAS, need

BLOCK = f"""
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {sorted({m for some in EXTRAS.values() for m in some})!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Absent())
from airtouch.cli import main
sys.argv = ["airtouch", *sys.argv[1:]]
main()
"""


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    path = tmp_path_factory.mktemp("base") / "flight.csv.gz"
    logs.write(short_flights.fly(1)[0], path)
    return path


def run(*arguments):
    return subprocess.run([sys.executable, "-c", BLOCK, *map(str, arguments)], capture_output=True, text=True, timeout=600)


@pytest.mark.parametrize("command", [
    ("evaluate", "{flight}", "--speed", "0.3"), ("evaluate", "{flight}", "--speed", "0.3", "--detector", "paper"),
    ("gap", "measure", "{flight}", "--report", "{out}/gap.html"), ("simulate", "hover", "--out", "{out}/flown", "--workers", "1"),
    ("logs", "check", "{flight}"), ("--help",)])
def test_works_without_any_extra(flight, tmp_path, command):
    done = run(*(word.format(flight=flight, out=tmp_path) for word in command))
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("command", [("demo", "--out", "{out}/demo"), ("train", "{flight}", "--out", "{out}/m.npz"),
                                     ("adapt", "{flight}", "--out", "{out}/m.npz"), ("twin", "{flight}", "--out", "{out}/twin")])
def test_training_says_at_once_what_is_missing(flight, tmp_path, command):
    done = run(*(word.format(flight=flight, out=tmp_path) for word in command))
    assert done.returncode == 2 and "pip install 'airtouch[train]'" in done.stderr and "tensorflow" in done.stderr, done.stderr
    assert "Traceback" not in done.stderr and not list(tmp_path.iterdir())


def test_a_report_without_matplotlib_says_which_extra_brings_pictures(flight, tmp_path):
    done = run("gap", "measure", flight, "--report", tmp_path / "gap.html")
    page = (tmp_path / "gap.html").read_text(encoding="utf-8")
    assert done.returncode == 0 and "airtouch[plots]" in page and "<img" not in page


@pytest.mark.parametrize("command, extra", [(("map", "{flight}", "--truth", "--out", "{out}/m.geojson"), "map"),
                                            (("gap", "blind", "run", "{out}/set", "-n", "1"), "plots")])
def test_plots_say_at_once_what_is_missing(flight, tmp_path, command, extra):
    done = run(*(word.format(flight=flight, out=tmp_path) for word in command))
    assert done.returncode == 2 and f"pip install 'airtouch[{extra}]'" in done.stderr and "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


def test_an_extra_that_is_missing_is_named(monkeypatch):
    monkeypatch.setitem(EXTRAS, "none", ("no_such_module_of_this_name",))
    with pytest.raises(AirTouchError, match=r"flying needs no_such_module_of_this_name: pip install 'airtouch\[none\]'"):
        need("none", "flying")
