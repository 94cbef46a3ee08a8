"""`airtouch crossval`: split by flight, resumed, stated."""

import json
import shutil

import pytest
from click.testing import CliRunner

from airtouch.cli import airtouch
from airtouch.cli.learning.crossval import command
from airtouch.detector import baseline
from airtouch.detector.evaluation import crossval
from airtouch.detector.evaluation.data import dataset
from airtouch.errors import AirTouchError


def run(*arguments):
    return CliRunner().invoke(command, [str(a) for a in arguments])


def test_every_flight_is_scored_by_a_model_that_never_saw_it(generated, tmp_path, monkeypatch):
    trained, scored = [], []
    fit, evaluate_flight = baseline.fit, crossval.evaluate.evaluate_flight

    def spy_fit(flights, **options):
        trained.append({log.source.rsplit("/", 1)[-1] for log in flights})
        return fit(flights, **options)

    def spy_evaluate(file, log, detector, model):
        scored.append((file.path.name, len(trained) - 1))
        return evaluate_flight(file, log, detector, model)

    monkeypatch.setattr(baseline, "fit", spy_fit)
    monkeypatch.setattr(crossval.evaluate, "evaluate_flight", spy_evaluate)
    first = crossval.crossval("baseline", dataset.collect([generated]), tmp_path)
    assert len(first.scores) == 4 and len(first.folds) == 2 and not first.left_out
    assert len(scored) == 4 and all(name not in trained[fold] for name, fold in scored)
    repeat = crossval.crossval("baseline", dataset.collect([generated]), tmp_path)
    assert len(trained) == 2, "finished folds are not done again"
    assert [s.as_dict() for s in repeat.scores] == [s.as_dict() for s in first.scores] and repeat.folds == first.folds


def test_the_command_writes_scores_and_a_line_of_the_ledger_for_each_look(generated, tmp_path):
    out, ledger = tmp_path / "cv.json", tmp_path / "looks.md"
    call = (generated, "--detector", "baseline", "--out", tmp_path / "folds", "--json", out, "--ledger", ledger)
    result = run(*call)
    assert result.exit_code == 0, result.output
    table = json.loads(out.read_text())
    assert table["flights"] == 4 and len(table["folds"]) == 2 and len(table["lag_s"]) == 2
    assert "done before" in run(*call, "--force").stderr
    assert ledger.read_text().count("baseline") == 2


@pytest.mark.parametrize("options, message", [
    (["--silence-training"], "needs --silence"), (["--random-epochs", 60], "needs --random-windows"),
    (["--random-windows"], "for --detector paper"), (["--epochs", 3], "best takes --steps"),
    (["--epochs", 3, "--detector", "baseline"], "the baseline has none"),
    (["--random-windows", "--detector", "baseline"], "for --detector paper")])
def test_an_option_without_its_other_is_refused(generated, tmp_path, options, message):
    result = run(generated, "--out", tmp_path / "folds", *options)
    assert result.exit_code == 2 and message in result.output and not (tmp_path / "folds").exists()


@pytest.mark.parametrize("detector", ["best", "baseline"])
def test_the_output_says_that_the_decoder_of_best_was_chosen_over_the_folds(generated, tmp_path, monkeypatch, detector):
    whole = crossval.crossval
    monkeypatch.setattr(crossval, "crossval", lambda _, *rest, **named: whole("baseline", *rest, **named))
    out = tmp_path / "cv.json"
    result = run(generated, "--detector", detector, "--out", tmp_path / "folds", "--json", out)
    assert result.exit_code == 0, result.output
    note = json.loads(out.read_text()).get("note", "")
    assert ("chosen over the five folds" in note) == (detector == "best")
    assert ("note: the decoder's settings and the recipe" in result.stdout) == (detector == "best")


def test_the_ledger_is_checked_before_the_work(generated, tmp_path, monkeypatch):
    monkeypatch.setattr(crossval, "crossval", lambda *_, **__: pytest.fail("it has begun"))
    result = run(generated, "--detector", "baseline", "--ledger", tmp_path)
    assert isinstance(result.exception, AirTouchError) and "is a folder" in str(result.exception)
    result = run(generated, "--detector", "baseline", "--ledger", "/proc/absent/looks.md")
    assert isinstance(result.exception, AirTouchError) and "cannot be made" in str(result.exception)


def test_the_ledger_may_be_in_a_new_folder(generated, tmp_path):
    ledger = tmp_path / "new" / "looks.md"
    result = run(generated, "--detector", "baseline", "--out", tmp_path / "folds", "--ledger", ledger)
    assert result.exit_code == 0 and "baseline" in ledger.read_text()


@pytest.mark.parametrize("name", ["adapt", "twin", "evaluate", "crossval", "map"])
def test_commands_take_the_same_speeds(name, tmp_path):
    out = ["--out", str(tmp_path / "out")] if name != "evaluate" else []
    call = [name, str(tmp_path / "absent"), *out, "--speed"]
    taken, refused = (CliRunner().invoke(airtouch, [*call, speed]) for speed in ("2", "101"))
    assert "no such file" in str(taken.exception), taken.output
    assert refused.exit_code == 2 and "0<x<=100" in refused.output


def test_a_damaged_cache_is_done_again(generated, tmp_path):
    files = dataset.collect([generated])
    crossval.crossval("baseline", files, tmp_path)
    for cache in tmp_path.glob("*.json"):
        cache.write_text(cache.read_text()[:100])
    assert len(crossval.crossval("baseline", files, tmp_path).scores) == 4


def test_the_cache_changes_with_the_conditions(generated, tmp_path):
    folder = shutil.copytree(generated, tmp_path / "copy")
    before = crossval.cache_key("baseline", (files := dataset.collect([folder])), files[:2], 0, {})
    manifest = folder / "manifest.csv"
    first = manifest.read_text().splitlines()[1]
    manifest.write_text(manifest.read_text().replace(first, first.replace(",low,", ",high,")))
    assert crossval.cache_key("baseline", (files := dataset.collect([folder])), files[:2], 0, {}) != before
    assert crossval.cache_key("baseline", (files := dataset.collect([generated])), files[2:], 0, {}) != before


@pytest.mark.parametrize(("old", "new", "message"),
                         [(",clean,1,", ",clean,0,", "two folds"), (",clean,1,", ",clean,,", "no fold")])
def test_folds_are_needed(generated, tmp_path, old, new, message):
    folder = shutil.copytree(generated, tmp_path / "copy")
    manifest = folder / "manifest.csv"
    manifest.write_text(manifest.read_text().replace(old, new))
    with pytest.raises(AirTouchError, match=message):
        crossval.crossval("baseline", dataset.collect([folder]), tmp_path / "out")


def test_baseline_has_no_filter(generated, tmp_path):
    with pytest.raises(AirTouchError, match="no physical filter"):
        crossval.crossval("baseline", dataset.collect([generated]), tmp_path, crossval.Settings(physical_filter=False))


def test_a_bad_flight_is_left_out(generated, tmp_path):
    folder = shutil.copytree(generated, tmp_path / "copy")
    (folder / "f1.csv.gz").write_bytes(b"")
    result = run(folder, "--detector", "baseline", "--out", tmp_path / "o")
    assert result.exit_code == 2 and "f1.csv.gz" in result.stderr and "1 left out" in result.stderr


def test_an_option_that_the_detector_does_not_have_is_refused(tmp_path):
    for options in (("--detector", "baseline", "--epochs", 3), ("--detector", "paper", "--steps", 3)):
        result = run(*options, "--out", tmp_path, tmp_path)
        assert result.exit_code == 2 and options[2] in result.stderr
