"""The runner: what is done stays, what cannot be made says so, what is of other settings is not replaced unasked."""

import csv
import json
import os
import subprocess
import sys
import types
from functools import partial

import pytest
from click.testing import CliRunner

from airtouch.cli.paper import command
from airtouch.errors import AirTouchError
from airtouch.paper_figures import run, words
from airtouch.paper_figures.claims import REPRODUCED, UNTESTABLE
from airtouch.paper_figures.figure import Figure, Job, Missing, Verdict


@pytest.fixture
def figures(monkeypatch):
    """Three figures in place of the real ones: one that works, one that lacks flights, one whose input is bad."""
    calls = []

    def works(job):
        calls.append(job.quick)
        verdicts = {name: Verdict(REPRODUCED, f"n = {len(calls)} <of 3>", "best alone")
                    for name in ("height-4cm", "height-9cm")}
        return Figure("Works", [{"what": "a", "value": 1.5}, {"what": "b", "n": 2}], "Simulated.", verdicts,
                      lambda canvas: canvas.subplots().plot([1, 2]))

    def lacks(job):
        raise Missing("no recorded flights here: give --flights")

    def bad(job):
        raise AirTouchError("log.csv:7: current is 'x', a number is needed")

    module = types.ModuleType("airtouch.paper_figures.figures.made_up")
    module.works, module.lacks, module.bad = works, lacks, bad
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(run, "FIGURES", {"fig8d": ("made_up", "works"), "fig8e": ("made_up", "lacks"),
                                         "table1": ("made_up", "bad")})
    return calls


def test_what_is_missing_is_said_and_the_others_are_made(figures, tmp_path):
    out = tmp_path / "paper"
    verdicts = run.run(run.names(()), out, Job(None, out / "work"))
    assert list(csv.DictReader((out / "fig8d.csv").open())) == [{"what": "a", "value": "1.5", "n": ""},
                                                                {"what": "b", "value": "", "n": "2"}]
    assert (out / "fig8d.png").read_bytes()[:4] == b"\x89PNG" and b"<svg" in (out / "fig8d.svg").read_bytes()
    assert not (out / "fig8e.csv").exists()
    assert "no recorded flights" in verdicts["fig8e"]["missing"] and "log.csv:7" in verdicts["table1"]["missing"]
    assert {c["verdict"] for name in ("fig8e", "table1") for c in verdicts[name]["claims"].values()} == {UNTESTABLE}
    page = (out / "index.html").read_text()
    assert "n = 1 &lt;of 3&gt;" in page and "Not made: no recorded flights" in page and "0.364" not in page


def test_one_process_has_one_thread_too_before_tensorflow_is_imported(tmp_path):
    """In a process of its own: figures of one group are made by the process that was started."""
    code = f"""
import sys, types
from pathlib import Path
from airtouch.paper_figures import run
from airtouch.paper_figures.figure import Figure, Job, Missing

def threads(job):
    print("before", "tensorflow" in sys.modules)
    import os
    print("TF", os.environ["TF_NUM_INTRAOP_THREADS"], os.environ["TF_NUM_INTEROP_THREADS"])
    raise Missing("of no matter")

module = types.ModuleType("airtouch.paper_figures.figures.made_up")
module.threads = threads
sys.modules[module.__name__] = module
run.FIGURES = {{"fig8e": ("made_up", "threads")}}
run.run(["fig8e"], Path({str(tmp_path)!r}), Job(None, Path({str(tmp_path)!r}) / "work"))
"""
    environment = {k: v for k, v in os.environ.items() if k not in run.ONE_THREAD}
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert "before False" in out.stdout and "TF 1 1" in out.stdout


def test_the_page_says_what_is_judged_and_by_which_margins(figures, tmp_path, monkeypatch):
    monkeypatch.setattr(words, "ERROR_MARGIN", 0.4)
    run.run(["fig8d", "fig8e"], tmp_path, Job(None, tmp_path / "work"))
    page = (tmp_path / "index.html").read_text()
    assert "at most 40 % above the paper" in page
    assert page.count("of best alone") == 2  # the two verdicts, and not those that could not be tested


def test_each_figure_keeps_the_command_that_made_it(figures, tmp_path):
    first, second = "airtouch paper --flights 'my flights'", "airtouch paper --only fig8e --power-log run.csv"
    run.run(["fig8d"], tmp_path, Job(None, tmp_path / "work"), command=first)
    run.run(["fig8d", "fig8e"], tmp_path, Job(None, tmp_path / "work"), command=second)
    page = (tmp_path / "index.html").read_text()
    assert page.index("my flights") < page.index('<section id="fig8e">') < page.index(second)
    assert json.loads((tmp_path / "fig8d.json").read_text())["command"] == first


def test_done_figures_stay_and_damaged_ones_are_made_again(figures, tmp_path):
    job = Job(None, tmp_path / "work")
    run.run(["fig8d"], tmp_path, job)
    run.run(["fig8d"], tmp_path, job)
    assert len(figures) == 1
    (tmp_path / "fig8d.svg").unlink()
    run.run(["fig8d"], tmp_path, job)
    (tmp_path / "fig8d.json").write_text('{"key": ')
    run.run(["fig8d"], tmp_path, job)
    run.run(["fig8d"], tmp_path, job, force=True)
    assert len(figures) == 4


def test_force_makes_again_what_the_work_folder_holds(monkeypatch, tmp_path):
    """The code changes between the runs, which no key of what is stored can see."""
    code = ["old"]

    def stored(path):
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(code[0])
        return path.read_text()

    def works(job):
        paths = ("folds/best_fold0_0.json", "folds/best_fold0_0.npz", "vision_12_24_5_0.json")
        read = " ".join(stored(job.work / path) for path in paths)
        verdicts = {name: Verdict(REPRODUCED, read) for name in ("height-4cm", "height-9cm")}
        return Figure("Works", [{"what": read}], "", verdicts, lambda canvas: canvas.subplots())

    module = types.ModuleType("airtouch.paper_figures.figures.made_up")
    module.works = works
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setattr(run, "FIGURES", {"fig8d": ("made_up", "works")})
    job = Job(None, tmp_path / "work")
    run.run(["fig8d"], tmp_path, job)
    (tmp_path / "work" / "notes.txt").write_text("of the user")
    code[0] = "new"
    run.run(["fig8d"], tmp_path, job, force=True)
    assert (tmp_path / "fig8d.csv").read_text() == "what\nnew new new\n"
    assert (tmp_path / "work" / "notes.txt").exists()


def test_figures_of_other_settings_are_not_replaced_unasked(figures, tmp_path):
    run.run(["fig8d"], tmp_path, Job(None, tmp_path / "work"))
    with pytest.raises(AirTouchError, match="fig8d.csv was made with other settings; use --force"):
        run.run(["fig8d"], tmp_path, Job(None, tmp_path / "work", quick=True))
    run.run(["fig8d"], tmp_path, Job(None, tmp_path / "work", quick=True), force=True)
    assert figures == [False, True] and json.loads((tmp_path / "fig8d.json").read_text())["quick"]


def test_a_whole_run_replaces_the_figures_of_a_quick_one(figures, tmp_path):
    run.run(["fig8d"], tmp_path, Job(None, tmp_path / "work", quick=True))
    run.run(["fig8d"], tmp_path, Job(None, tmp_path / "work"))
    assert figures == [True, False] and not json.loads((tmp_path / "fig8d.json").read_text())["quick"]


def test_a_figure_is_stale_by_what_it_reads_alone(figures, tmp_path):
    flights, air = tmp_path / "data" / "flights", tmp_path / "data" / "imrclab"
    for folder in (flights, air):
        folder.mkdir(parents=True)
        (folder / "a.csv").write_text("t_s\n0\n")
    log = tmp_path / "run.csv"
    log.write_text("time_ms\n")
    job = Job(flights, tmp_path / "work")
    run.run(["fig8d"], tmp_path, job)
    run.run(["fig8d"], tmp_path, Job(flights, tmp_path / "work", power_log=log))
    assert len(figures) == 1  # no power is in it
    assert run.settings_key(job, "table1") != run.settings_key(Job(flights, tmp_path, power_log=log), "table1")
    assert run.settings_key(job, "wind") == run.settings_key(Job(None, tmp_path), "wind")
    (air / "b.csv").write_text("t_s\n0\n")  # `best` is trained on it too
    with pytest.raises(AirTouchError, match="fig8d.csv was made with other settings"):
        run.run(["fig8d"], tmp_path, job)


def test_the_command_says_each_verdict_and_that_something_is_missing(figures, tmp_path, monkeypatch):
    monkeypatch.setattr("airtouch.cli.paper.find_flights", lambda: None)
    # one worker: a process of its own would make the real figures, not these
    result = CliRunner().invoke(command, ["--out", str(tmp_path), "--workers", "1"])
    lines = [line.split(maxsplit=1) for line in result.stdout.splitlines() if not line.startswith(" ")]
    verdicts = [(name, rest) for name, rest in lines if name in ("fig8d", "fig8e", "table1")]
    assert [name for name, rest in verdicts if rest.startswith(REPRODUCED)] == ["fig8d", "fig8d"]
    assert [name for name, rest in verdicts if rest.startswith(UNTESTABLE)] == ["fig8e"] * 2 + ["table1"] * 2
    assert result.exit_code == 2 and "Not made" not in result.stdout
    with pytest.raises(AirTouchError, match="no figure 'fig8x'; did you mean"):
        run.names(["fig8x"])
    missing = CliRunner().invoke(command, ["--flights", str(tmp_path / "none"), "--out", str(tmp_path)])
    assert "no such file or folder" in str(missing.exception)


def test_a_power_log_that_no_chosen_figure_reads_is_refused(tmp_path):
    (tmp_path / "run.json").write_text("{}")
    result = CliRunner().invoke(command, ["--only", "range", "--power-log", str(tmp_path / "run.json"),
                                          "--out", str(tmp_path / "out")])
    assert result.exit_code == 2 and "--power-log is for table1" in result.stderr and not (tmp_path / "out").exists()


def test_processes_make_the_same_figures(tmp_path):
    chosen, messages = ["table1", "range"], tmp_path / "told"
    for out, workers in (("one", 1), ("two", 2)):
        job = Job(None, tmp_path / out / "work", tell=partial(note, messages))
        run.run(chosen, tmp_path / out, job, workers=workers)
    for name in chosen:
        for ending in ("csv", "svg", "png"):
            file = f"{name}.{ending}"
            assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()
    assert "range" in (tmp_path / "two" / "index.html").read_text() and messages.read_text().count("written") == 4


def note(path, line):
    """Append a line to a file: a `tell` that other processes can call."""
    with path.open("a") as file:
        file.write(line + "\n")


def test_every_figure_is_in_one_group():
    assert sorted(name for group in run.GROUPS for name in group) == sorted(run.FIGURES)
