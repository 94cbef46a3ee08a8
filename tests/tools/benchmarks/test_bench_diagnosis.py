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
    monkeypatch.setattr(bench_diagnosis, "seconds", lambda processors, out, cache:
                        next(base) / (2 if processors == free else 1) / (2 if cache else 1))
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: free)
    monkeypatch.setattr(sys, "argv", ["bench_diagnosis.py", "--runs", "3"])
    bench_diagnosis.main()
    assert capsys.readouterr().out.splitlines() == [
        "first flight, 3 processors: 10.0 s, 5.0 to 15.0 s in 3 runs",
        "first flight, 1 processor: 20.0 s, 10.0 to 30.0 s in 3 runs",
        "further flight, 3 processors: 5.0 s, 2.5 to 7.5 s in 3 runs",
        "further flight, 1 processor: 10.0 s, 5.0 to 15.0 s in 3 runs"]


def test_the_diagnosis_that_is_timed_has_the_cache_and_a_failed_one_is_told(monkeypatch, tmp_path):
    runs = []

    def run(command, env, **_):
        runs.append((command, env[VARIABLE]))
        return subprocess.CompletedProcess(command, 0 if len(runs) == 1 else 2, "", "a warning\ngap: no such vehicle\n")

    monkeypatch.setattr(subprocess, "run", run)
    assert bench_diagnosis.seconds({0}, tmp_path, "kept") >= 0.0
    command, cache = runs[0]
    assert cache == "kept" and command[command.index("--json") + 1] == str(tmp_path / "it.json")
    flights = [word for word in command if word.endswith(".csv.gz")]
    assert len(flights) == 5 and all(Path(flight).is_file() for flight in flights)
    with pytest.raises(AirTouchError, match="gap: no such vehicle"):
        bench_diagnosis.seconds({0}, tmp_path, "")
