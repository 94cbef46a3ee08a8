"""The base install detects, diagnoses and simulates: nothing on those paths asks for an extra."""

import json
import re
import subprocess
import sys
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import pytest

import airtouch
import short_flights
from airtouch import logs
from airtouch.errors import AirTouchError
from airtouch.extras import EXTRAS, need
from patience import HANG_S

#: Every command as a process of its own, forked from one that has imported what most of them need.
BLOCK = f"""
import json, os, sys, traceback
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {sorted({m for some in EXTRAS.values() for m in some})!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Absent())
import airtouch.gap.measurement, airtouch.simulation.batch
from airtouch.cli import main
for words, folder in json.load(sys.stdin):
    if not (pid := os.fork()):
        for number, name in ((1, "out"), (2, "err")):
            os.dup2(os.open(folder + "." + name, os.O_WRONLY | os.O_CREAT), number)
        sys.argv, code = ["airtouch", *words], 0
        try:
            main()
        except SystemExit as left:
            code = left.code or 0
        except BaseException:
            code = traceback.print_exc() or 1
        sys.stdout.flush(), sys.stderr.flush()
        os._exit(code)  # to tear the interpreter down takes longer than most commands
    print(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
"""
WORKS = [("evaluate", "{flight}", "--speed", "0.3"), ("evaluate", "{flight}", "--speed", "0.3", "--detector", "paper"),
         ("gap", "measure", "{flight}", "--report", "{out}/gap.html"),
         ("simulate", "hover", "--out", "{out}/flown", "--workers", "1"), ("logs", "check", "{flight}"), ("--help",)]
TRAINS = [("demo", "--out", "{out}/demo"), ("train", "{flight}", "--out", "{out}/m.npz"),
          ("adapt", "{flight}", "--out", "{out}/m.npz"), ("twin", "{flight}", "--out", "{out}/twin")]
DRAWS = {("map", "{flight}", "--truth", "--out", "{out}/m.geojson"): "map",
         ("gap", "measure", "{flight}", "--plots", "{out}/plots"): "plots",
         ("gap", "blind", "run", "{out}/set", "-n", "1"): "plots"}


@dataclass(frozen=True)
class Done:
    """What a command came to; out: the folder that it was given."""

    code: int
    error: str
    out: Path


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory):
    """Every command without any extra."""
    folder = tmp_path_factory.mktemp("base")
    flight = folder / "flight.csv.gz"
    logs.write(short_flights.fly(1)[0], flight)
    commands = [*WORKS, *TRAINS, *DRAWS]
    places = [folder / str(i) for i in range(len(commands))]
    jobs = []
    for command, place in zip(commands, places, strict=True):
        place.mkdir()
        jobs.append(([word.format(flight=flight, out=place) for word in command], str(place)))
    process = subprocess.run([sys.executable, "-c", BLOCK], input=json.dumps(jobs), capture_output=True, text=True,
                             timeout=HANG_S)
    assert process.returncode == 0, process.stderr
    return {command: Done(int(code), place.with_name(place.name + ".err").read_text(), place)
            for command, place, code in zip(commands, places, process.stdout.split(), strict=True)}


@pytest.mark.parametrize("command", WORKS)
def test_works_without_any_extra(outcomes, command):
    assert outcomes[command].code == 0, outcomes[command].error


@pytest.mark.parametrize("command", TRAINS)
def test_training_says_at_once_what_is_missing(outcomes, command):
    outcome = outcomes[command]
    assert outcome.code == 2 and "tensorflow" in outcome.error, outcome.error
    assert "pip install 'airtouch[train]'" in outcome.error
    assert "Traceback" not in outcome.error and not list(outcome.out.iterdir())


def test_a_report_without_matplotlib_says_which_extra_brings_pictures(outcomes):
    page = (outcomes[WORKS[2]].out / "gap.html").read_text(encoding="utf-8")
    assert "airtouch[plots]" in page and "<img" not in page


@pytest.mark.parametrize("command", DRAWS)
def test_plots_say_at_once_what_is_missing(outcomes, command):
    outcome = outcomes[command]
    assert outcome.code == 2 and f"pip install 'airtouch[{DRAWS[command]}]'" in outcome.error
    assert "Traceback" not in outcome.error
    assert not list(outcome.out.iterdir())


def test_an_extra_that_is_missing_is_named(monkeypatch):
    monkeypatch.setitem(EXTRAS, "none", ("no_such_module_of_this_name",))
    with pytest.raises(AirTouchError,
                       match=r"flying needs no_such_module_of_this_name: pip install 'airtouch\[none\]'"):
        need("none", "flying")


def test_base_install_takes_less_than_400_mb():
    """Files of the package and of all that it requires without an extra, byte code aside."""
    names, todo = set(), ["airtouch"]
    while todo:
        name = todo.pop().lower().replace("_", "-")
        if name in names:
            continue
        names.add(name)
        todo += [re.match(r"[\w.-]+", line).group() for line in metadata.requires(name) or ()
                 if "extra ==" not in line and "python_version <" not in line]
    assert {"numpy", "scipy", "numba", "llvmlite"} <= names and not names & {"tensorflow-cpu", "matplotlib", "pandas"}
    files = [Path(str(file.locate())) for name in names - {"airtouch"} for file in metadata.files(name)]
    files += [f for f in Path(airtouch.__file__).parent.rglob("*") if f.is_file()]
    size = sum(f.stat().st_size for f in files if f.exists() and f.suffix not in (".pyc", ".nbc", ".nbi"))
    assert 200e6 < size < 400 * 2**20, f"{size / 2**20:.0f} MB of {sorted(names)}"
