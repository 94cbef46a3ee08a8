"""The times of `bench_diagnosis.py`, with a stand-in for the diagnosis."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from airtouch.errors import AirTouchError
from airtouch.gap.nominal.kept_scatter import VARIABLE
from tools.benchmarks import bench_diagnosis


def test_each_row_has_the_median_of_its_own_runs(monkeypatch, capsys):
    """A first flight takes 10, 30 and 20 s on one processor, half on all, and half of each with the scatter kept."""
    free = set(range(3))
    base = iter([99.0, *(x for run in (10.0, 30.0, 20.0) for x in [run] * 4)])  # the warm-up first
    monkeypatch.setattr(bench_diagnosis, "seconds", lambda arguments, processors, out, cache:
                        next(base) / (2 if processors == free else 1) / (2 if cache else 1))
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: free)
    monkeypatch.setattr(sys, "argv", ["bench_diagnosis.py", "no-such-folder", "--runs", "3"])
    bench_diagnosis.main()
    assert capsys.readouterr().out.splitlines() == [
        "packaged flight, first, 3 processors: 10.0 s, 5.0 to 15.0 s in 3 runs",
        "packaged flight, first, 1 processor: 20.0 s, 10.0 to 30.0 s in 3 runs",
        "packaged flight, further, 3 processors: 5.0 s, 2.5 to 7.5 s in 3 runs",
        "packaged flight, further, 1 processor: 10.0 s, 5.0 to 15.0 s in 3 runs"]


def test_recorded_flights_are_timed_where_all_their_files_are(tmp_path):
    (tmp_path / "flights").mkdir()
    flight, vehicle, baseline = bench_diagnosis.RECORDED["recorded wake"]
    (tmp_path / f"{vehicle}.toml").touch()
    for name in (flight, f"{baseline}_2", f"{baseline}_1"):
        (tmp_path / "flights" / f"{name}.csv.gz").touch()
    (arguments,) = bench_diagnosis.recorded(tmp_path).values()
    assert [Path(a).name for a in arguments] == [
        f"{flight}.csv.gz", "--vehicle", f"{vehicle}.toml", "--baseline", f"{baseline}_1.csv.gz",
        f"{baseline}_2.csv.gz"]
    assert bench_diagnosis.recorded(tmp_path / "nowhere") == {}


def test_the_diagnosis_that_is_timed_has_the_cache_and_a_failed_one_is_told(monkeypatch, tmp_path):
    runs = []

    def run(command, env, **_):
        runs.append((command, env[VARIABLE]))
        return subprocess.CompletedProcess(command, 0 if len(runs) == 1 else 2, "", "a warning\ngap: no such vehicle\n")

    monkeypatch.setattr(subprocess, "run", run)
    assert bench_diagnosis.seconds(bench_diagnosis.packaged(), {0}, tmp_path, "kept") >= 0.0
    command, cache = runs[0]
    assert cache == "kept" and command[command.index("--json") + 1] == str(tmp_path / "it.json")
    flights = [word for word in command if word.endswith(".csv.gz")]
    assert len(flights) == 5 and all(Path(flight).is_file() for flight in flights)
    with pytest.raises(AirTouchError, match="gap: no such vehicle"):
        bench_diagnosis.seconds(bench_diagnosis.packaged(), {0}, tmp_path, "")
