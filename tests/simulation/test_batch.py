"""Batches: the same flights whatever the workers; resume; nothing bad written; dask."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

from airtouch import logs
from airtouch.cli.simulate import command
from airtouch.errors import AirTouchError
from airtouch.logs import true_edges
from airtouch.simulation import batch, flight, scenario
from airtouch.simulation.workers import cluster, store

QUICK = """
name = "quick"
[values]
height = { low = 0.3, high = 0.5 }
[[mission.step]]
do = "take-off"
height_m = "= height"
time_s = 1.0
[[mission.step]]
do = "hover"
time_s = 1.0
[effects]
motor_noise = {}
"""


@pytest.fixture
def quick(tmp_path):
    path = tmp_path / "quick.toml"
    path.write_text(QUICK)
    return path


def table(log):
    return np.column_stack(list(log.columns.values()))


def test_flights_do_not_depend_on_workers_or_batch():
    scene = scenario.parse(QUICK, "quick")
    by_one = batch.simulate(scene, seeds=4, workers=1)
    for other in (batch.simulate(scene, seeds=4, workers=3), batch.simulate(scene, seeds=[3, 2, 1, 0])[::-1]):
        for a, b in zip(by_one, other, strict=True):
            np.testing.assert_array_equal(table(a), table(b))
    assert not np.array_equal(table(by_one[0])[-1], table(by_one[1])[-1])
    other_seed = batch.simulate(scene, seeds=1, seed=1)[0]
    assert not np.array_equal(table(by_one[0])[-1], table(other_seed)[-1])


@pytest.mark.parametrize(("wrong", "message"), [
    ({"seed": -1}, "seed must be a whole number, 0 or more, not -1"),
    ({"workers": 0}, "workers must be a whole number, 1"),
    ({"count": -3}, "the number of flights must be"), ({"count": [0, -1]}, "a flight's number must be"),
    *(({"count": count}, "the number of flights must be a whole number, 0 or more, not ")
      for count in (3.0, True, None, np.bool_(True), np.array(3))),
    ({"count": [True]}, "a flight's number must be"), ({"seed": True}, "seed must be"),
    ({"count": np.array([0.5])}, "a flight's number must be"), ({"effects": {"nope": {}}}, "no effect 'nope'"),
    ({"effects": {"wind": {"x": 1e9}}}, "wind: x"), ({"without": ["nope"]}, "no effect 'nope'")])
def test_bad_input_is_refused_at_the_call(wrong, message):
    with pytest.raises(AirTouchError) as error:
        batch.flights(scenario.parse(QUICK, "quick"), **({"count": 1} | wrong))
    assert message in str(error.value)


def test_numbers_of_numpy_are_numbers():
    scene = scenario.parse(QUICK, "quick")
    two = batch.simulate(scene, seeds=np.int64(2), seed=np.int64(1), workers=np.int64(1))
    assert [log.meta["flight"] for log in two] == [0, 1]
    (second,) = batch.simulate(scene, seeds=np.array([1]), seed=1)
    np.testing.assert_array_equal(table(second), table(two[1]))
    with pytest.raises(AirTouchError, match="a flight's number must be"):
        batch.simulate(scene, seeds=[-1])


def test_the_generator_flies_only_a_little_ahead(monkeypatch):
    numbers = []
    real = batch.fly
    monkeypatch.setattr(batch, "fly", lambda *a, **k: numbers.append(a[3]) or real(*a, **k))
    flying = batch.flights(scenario.parse(QUICK, "quick"), 10_000, workers=2)
    for _ in range(3):
        next(flying)
    flying.close()
    assert len(numbers) <= 3 + batch.AHEAD * 2 + 2


@pytest.mark.parametrize("name", scenario.names())
def test_every_built_in_scenario_flies(name, vehicle):
    log = flight.fly(scenario.load(name), vehicle, 0, 1)
    assert not isinstance(log, flight.Diverged), str(log)
    assert log["z_m"].max() > 0.03
    assert log["z_m"][-1] < 0.05
    if name == "randomised" or name.startswith("paper") and not any(m in name for m in ("cement", "grass")):
        assert [e.kind for e in true_edges(log)] == ["entry", "exit"]


def test_command_writes_flights_and_continues(quick, tmp_path):
    out = tmp_path / "out"
    args = [str(quick), "--flights", "5", "--out", str(out), "--effect", "wind:x=0.1m/s"]
    assert CliRunner().invoke(command, args, catch_exceptions=False).exit_code == 0
    files = sorted(out.glob("*.csv.gz"))
    assert len(files) == 5
    log = logs.read(files[0])
    assert log.has("acc_world_x_mps2", "rpm_4", "vbat_V")
    assert ["wind", {"x": 0.1, "y": 0.0, "z": 0.0, "drag": 0.0147, "lever": 0.0}] in log.meta["effects"]
    stamps = {f: f.stat().st_mtime_ns for f in files[1:]}
    before = files[0].read_bytes()
    files[0].unlink()
    CliRunner().invoke(command, args, catch_exceptions=False)
    assert files[0].read_bytes() == before
    assert {f: f.stat().st_mtime_ns for f in files[1:]} == stamps
    with pytest.raises(AirTouchError, match="another request"):
        CliRunner().invoke(command, [*args, "--seed", "3"], catch_exceptions=False)
    assert (out / "manifest.csv").read_text().count("clean") == 5


KILLED = """
import os, sys
from airtouch.cli.simulate import command

rename, flights = os.replace, []

def wait_to_be_killed(source, target):
    if str(target).endswith(".csv.gz"):
        flights.append(target)
    if len(flights) == 4:
        print("the fourth", flush=True)
        sys.stdin.read()
    rename(source, target)

os.replace = wait_to_be_killed
command()
"""


def test_a_killed_run_continues(quick, tmp_path):
    out = tmp_path / "out"
    args = [str(quick), "--flights", "8", "--out", str(out), "--workers", "2"]
    with subprocess.Popen([sys.executable, "-c", KILLED, *args], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                          text=True) as process:
        assert process.stdout.readline() == "the fourth\n"
        process.kill()
    times = {f.name: f.stat().st_mtime_ns for f in out.glob("*.csv.gz")}
    assert len(times) == 3 and len(list(out.glob(".quick_*"))) == 1  # the fourth is written and has not its name yet
    CliRunner().invoke(command, args, catch_exceptions=False)
    files = sorted(out.glob("*.csv.gz"))
    assert len(files) == 8
    assert all((out / name).stat().st_mtime_ns == stamp for name, stamp in times.items())
    assert all(len(logs.read(f)) > 100 for f in files)


def test_diverged_flights_are_reported_and_never_written(quick, tmp_path):
    out = tmp_path / "out"
    args = [str(quick), "--flights", "2", "--out", str(out), "--effect", "weak_motor:rotor=1,thrust_loss=0.9"]
    result = CliRunner().invoke(command, args, catch_exceptions=False)
    assert result.exit_code == 1
    assert "flight 0 of seed 0 diverged" in result.output
    assert not list(out.glob("*.csv.gz"))
    assert len(store.failures(out)) == 2
    with pytest.raises(AirTouchError, match="seed 0, flight 0"):
        batch.simulate(quick, effects={"weak_motor": {"thrust_loss": 0.9}})


@pytest.mark.parametrize(("change", "message"), [
    (("height_m = \"= height\"", "height_m = \"= heigth\""), "uses 'heigth'"),
    (('do = "hover"', 'do = "dance"'), "no step 'dance'"),
    (("time_s = 1.0\n[effects]", "time_s = -1.0\n[effects]"), "must be positive"),
    (("motor_noise", "motor_noize"), "no effect 'motor_noize'"),
    (("[effects]", "[efects]"), "unknown key efects"),
    (('do = "hover"\ntime_s = 1.0', 'do = "go"\ndistance_m = 2.0\nspeed_mps = 4.0'),
     "faster than the firmware"),
    (('do = "hover"\ntime_s = 1.0', 'do = "go"\nheight_m = -0.2\nspeed_mps = 0.2'), "through a surface"),
])
def test_bad_scenarios_get_one_clear_line(change, message):
    text = QUICK.replace(*change)
    assert text != QUICK
    with pytest.raises(AirTouchError, match=message) as error:
        scenario.parse(text, "quick.toml")
    assert "\n" not in str(error.value)


def test_a_vehicle_too_heavy_to_fly_is_refused(vehicle):
    from dataclasses import replace
    with pytest.raises(AirTouchError, match="cannot lift itself"):
        flight.fly(scenario.parse(QUICK, "quick"), replace(vehicle, mass_kg=0.09))


def test_dask_gives_every_flight_once_though_a_worker_dies(quick, tmp_path, vehicle):
    distributed = pytest.importorskip("dask.distributed")
    scene = scenario.load(quick)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
                                  silence_logs=50) as local:
        client = cluster.connect(local.scheduler_address)
        numbers, killed = [], False
        for result in cluster.flights(client, scene, range(150), vehicle=vehicle):
            numbers.append(result.meta["flight"])
            if len(numbers) == 10 and not killed:
                killed = True
                os.kill(next(iter(local.workers.values())).process.pid, 9)
        sample = next(iter(cluster.flights(client, scene, [7], vehicle=vehicle)))
        client.close()
    assert killed
    assert sorted(numbers) == list(range(150))
    np.testing.assert_array_equal(table(sample), table(flight.fly(scene, vehicle, 0, 7)))


def test_two_requests_on_one_scheduler_get_each_its_own_flights(vehicle):
    distributed = pytest.importorskip("dask.distributed")
    scene, wind = scenario.parse(QUICK, "quick"), {"wind": {"x": 0.2}}
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as local:
        with distributed.Client(local) as one, distributed.Client(local) as two:
            calm = cluster.flights(one, scene, range(3), vehicle=vehicle)
            first = next(calm)  # its others wait at the scheduler
            windy = list(cluster.flights(two, scene, range(3), vehicle=vehicle, effects=wind))
            calm = [first, *calm]
    for logs_of, effects in ((calm, ()), (windy, wind)):
        for log in logs_of:
            expected = flight.fly(scene, vehicle, 0, log.meta["flight"], effects=effects)
            np.testing.assert_array_equal(table(log), table(expected))


def test_failures_survive_a_line_cut_short(tmp_path):
    line = json.dumps({"flight": 3, "seed": 0, "reason": "x", "time_s": 1.0, "scenario": "s"})
    (tmp_path / store.FAILED).write_text(line + "\n" + line[:20])
    assert [f["flight"] for f in store.failures(tmp_path)] == [3]
