"""`airtouch evaluate` from the outside: figures, bad files, exit codes."""

import json
import math
import shutil

import pytest
from click.testing import CliRunner

import airtouch as at
from airtouch import logs
from airtouch.cli.evaluate import command
from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog

KEYS = {"detector", "flights", "edges", "mean_abs_error_m", "missed", "false_per_minute", "hit", "balanced_accuracy",
        "intervals", "per_flight", "missed_count", "false_count", "airborne_minutes", "mean_abs_error_s", "ece",
        "by_height", "by_angle", "by_wind", "lag_s", "parameters", "left_out"}


def run(*arguments):
    return CliRunner().invoke(command, [str(a) for a in arguments])


def no_constant(name):
    raise ValueError(name)


def test_the_scores_of_a_folder_are_those_of_its_edges(generated, tmp_path):
    out = tmp_path / "out.json"
    result = run(generated, "--detector", "baseline", "--json", out)
    assert result.exit_code == 0, result.output
    table = json.loads(out.read_text(), parse_constant=no_constant)
    assert KEYS <= set(table) and set(table["hit"]) == {"0.05", "0.10", "0.25"}
    assert table["flights"] == 4 and table["edges"] == sum(len(f["edges"]) for f in table["per_flight"]) >= 8
    matched = [e for f in table["per_flight"] for e in f["edges"] if e["detected_sample"] is not None]
    assert table["missed"] == pytest.approx(1 - len(matched) / table["edges"])
    assert table["false_count"] == sum(len(f["false"]) for f in table["per_flight"])
    for f in table["per_flight"]:
        assert f["detections"] == len(f["false"]) + sum(e["detected_sample"] is not None for e in f["edges"])
        for e in f["edges"]:
            if e["detected_sample"] is not None:
                late = (e["detected_sample"] - e["true_sample"]) * 0.01 - table["lag_s"]
                assert e["error_s"] == pytest.approx(-late)
                assert e["error_m"] == pytest.approx(-late * f["condition"]["speed_mps"])
    for value in (table[k] for k in ("mean_abs_error_m", "missed", "false_per_minute", "balanced_accuracy")):
        assert value is None or math.isfinite(value)
    assert "missed" in result.output and "false/min" in result.output


@pytest.mark.parametrize(("trained", "of", "says"), [
    (1, 1, "this flight, so"), (3, 3, "all 3 of these flights, so"), (1, 3, "1 of these 3 flights, so")])
def test_the_warning_counts_only_where_there_is_something_to_count(generated, monkeypatch, trained, of, says):
    numbers = iter(range(of))
    monkeypatch.setattr(at.detector.evaluation.evaluate.training_set, "contains", lambda *_: next(numbers) < trained)
    result = run(*sorted(generated.glob("*.csv*"))[:of], "--speed", 0.3)
    assert f"the model was trained on {says}" in " ".join(result.output.split())


def test_a_fold_without_flights_is_named(generated):
    result = run(generated, "--detector", "baseline", "--fold", "77")
    assert isinstance(result.exception, AirTouchError)
    assert str(result.exception) == "no flight is in fold 77 of the manifest; its folds are 0, 1"


def test_flights_that_the_manifest_leaves_out_are_counted(generated, tmp_path):
    names = ["f0.csv.gz", "f1.csv.gz", "f2.csv.gz", "f3.csv.gz"]
    for name in names:
        shutil.copy(generated / name, tmp_path)
    (tmp_path / "manifest.csv").write_text("file,use,fold,speed_mps\nf0.csv.gz,clean,0,0.3\nf1.csv.gz,clean,1,0.3\n"
                                           "f2.csv.gz,messy,0,0.3\n")
    warning = ("airtouch: 1 flights are scored, 3 are not: 1 messy in the manifest, 1 not in the manifest, "
               "1 of another fold")
    result = run(tmp_path, "--detector", "baseline", "--fold", 0)
    assert result.exit_code == 0
    assert warning in result.stderr.splitlines(), result.stderr
    # a flight that is named is taken
    assert "are not" not in run(tmp_path / "f2.csv.gz", "--detector", "baseline").stderr


def test_bad_files_are_named_once_and_the_others_go_on(generated, bad, tmp_path):
    out = tmp_path / "out.json"
    result = run(generated / "f0.csv.gz", *bad.values(), "--speed", 0.3, "--detector", "baseline", "--json", out)
    assert result.exit_code == 2
    lines = [line for line in result.stderr.splitlines() if line.startswith("airtouch: ")]
    for name, path in bad.items():
        about = [line for line in lines if str(path) in line]
        assert len(about) == 1, (name, lines)
    assert f"1 flights scored, {len(bad)} left out" in lines[-1]
    table = json.loads(out.read_text(), parse_constant=no_constant)
    assert table["flights"] == 1 and len(table["left_out"]) == len(bad)


@pytest.mark.parametrize(("name", "message"), [
    ("fast", "airtouch logs convert --rate 100"), ("nan", "missing (NaN)"), ("constant", "constant"),
    ("stuck", "gyro y is constant"), ("copied", "is a copy of"), ("grounded", "no flight"), ("short", "1.50 s of data"),
    ("empty", "empty")])
def test_the_reason_and_the_remedy(bad, name, message):
    result = run(bad[name], "--speed", 0.3, "--detector", "baseline")
    assert result.exit_code == 2 and message in result.stderr
    assert "Traceback" not in result.output


def test_speed_must_be_known(generated, tmp_path):
    log = logs.read(generated / "f0.csv.gz")
    logs.write(FlightLog(log.columns, {k: v for k, v in log.meta.items() if k != "condition"}), tmp_path / "f0.csv.gz")
    result = run(tmp_path, "--detector", "baseline")
    assert result.exit_code == 2 and "--speed" in result.stderr
    assert run(tmp_path, "--detector", "baseline", "--speed", 0.3).exit_code == 0


@pytest.mark.parametrize("written", ["simulate", "collect"])
def test_the_speed_in_the_log_serves_where_no_manifest_is_beside_it(generated, tmp_path, written):
    log = logs.read(generated / "f0.csv.gz")
    speed, out = log.meta["condition"]["speed"], tmp_path / "out.json"
    if written == "collect":
        log = FlightLog(log.columns, {**log.meta, "condition": {}, "speed_mps": speed})
    logs.write(log, tmp_path / "alone.csv.gz")
    assert run(tmp_path / "alone.csv.gz", "--detector", "baseline", "--json", out).exit_code == 0
    (alone,), table = json.loads(out.read_text())["per_flight"], at.evaluate(log, "baseline")
    assert alone["condition"]["speed_mps"] == pytest.approx(speed)
    assert alone["edges"] == at.evaluate(tmp_path / "alone.csv.gz", "baseline")["per_flight"][0]["edges"]
    assert alone["edges"] == table["per_flight"][0]["edges"]


def test_without_down_range_detections_are_listed_not_judged(generated, tmp_path):
    log = logs.read(generated / "f0.csv.gz")
    del log.columns["zrange_m"]
    logs.write(log, tmp_path / "f.csv")
    out = tmp_path / "out.json"
    result = run(tmp_path / "f.csv", "--detector", "baseline", "--json", out)
    assert result.exit_code == 0, result.output
    table = json.loads(out.read_text(), parse_constant=no_constant)
    assert table["false_per_minute"] is None and table["edges"] == 0 and table["per_flight"][0]["false"] is None
    assert "no down range" in result.output


def test_nothing_is_overwritten_without_force(generated, tmp_path):
    out = tmp_path / "out.json"
    out.write_text("mine")
    log = generated / "f0.csv.gz"
    result = run(log, "--detector", "baseline", "--json", out)
    assert isinstance(result.exception, AirTouchError) and out.read_text() == "mine"
    assert run(log, "--detector", "baseline", "--json", out, "--force").exit_code == 0


@pytest.mark.parametrize("arguments", [("none.csv",), ("--detector", "oracle", "."), ()])
def test_a_wrong_call_is_refused_in_one_line(arguments):
    result = run(*arguments)
    assert isinstance(result.exception, AirTouchError) or result.exit_code == 2
    assert "\n" not in str(result.exception)


def test_a_foreign_model_is_refused(generated, tmp_path):
    (tmp_path / "m.npz").write_bytes(b"PK nonsense")
    result = run(generated, "--model", tmp_path / "m.npz")
    assert isinstance(result.exception, AirTouchError) and "m.npz" in str(result.exception)


def test_messy_flights_never_stop_the_batch(flights):
    import csv

    with (flights / "airtouch" / "manifest.csv").open() as handle:
        messy = [flights / "airtouch" / row["file"] for row in csv.DictReader(handle) if row["use"] == "messy"]
    result = run(*messy, "--speed", 0.3, "--detector", "baseline")
    assert result.exit_code == 2 and (result.exception is None or isinstance(result.exception, SystemExit))


def test_remarks_on_flights_of_one_name_in_two_folders_are_both_there(generated, tmp_path):
    log = logs.read(generated / "f0.csv.gz")
    times = log["t_s"].copy()
    times[500] -= 0.5
    paths = [tmp_path / folder / "f.csv" for folder in ("a", "b")]
    for path in paths:
        path.parent.mkdir()
        logs.write(log.with_columns({**log.columns, "t_s": times}), path)
    for chosen, keys in ((paths, {str(path) for path in paths}), (paths[:1], {"f.csv"})):
        result = run(*chosen, "--detector", "baseline", "--speed", 0.3, "--json", tmp_path / "o.json", "--force")
        assert result.exit_code == 0, result.output
        written = json.loads((tmp_path / "o.json").read_text())
        assert set(written["remarks"]) == keys and "1 times" in str(written["remarks"])
        in_python = at.evaluate(chosen, "baseline", speed_mps=0.3)
        assert in_python.keys() == written.keys() and in_python["remarks"] == written["remarks"]
    in_memory = at.evaluate(logs.read(paths[0]), "baseline", speed_mps=0.3)
    assert in_memory["remarks"] == {"f.csv": written["remarks"]["f.csv"]}
