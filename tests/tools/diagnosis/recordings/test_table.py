"""The table of `gap_real.py`: what counts as an answer, and its counts, on synthetic results."""

from collections import Counter

import pytest
from scipy.stats import binomtest

from tools.diagnosis.recordings import table


def result(row, truth, *effects, verdict="effect", condition="", **more):
    """A result whose diagnosis names these effects."""
    return {"row": row, "truth": truth, "condition": condition, "verdict": verdict,
            "flight": "a.csv.gz", "effects": [{"name": e, "parameters": {}, **more} for e in effects]}


@pytest.mark.parametrize(("diagnosed", "answer"), [
    (result("swarm", "downwash", "downwash", "mass"), "downwash"),
    (result("swarm", "none", verdict="none"), "none"),
    (result("swarm", "downwash", verdict="unknown"), "unknown"),
    (result("fan", "comes and goes", "gust", seconds=[{"from_s": 4.0}]), "comes and goes"),
    (result("fan", "comes and goes", "gust", seconds=[]), "gust"),  # always there
    (result("fan", "comes and goes", "mass", seconds=[{"from_s": 4.0}]), "mass"),
    (result("peers", "mass", "thrust_coefficient"), "mass"),  # one thing in these logs
    (result("peers", "mass", "weak_motor"), "weak_motor"),
    (result("crazypad", "slung load", "slung_load"), "slung load"),
    (result("crazypad", "normal", verdict="none"), "normal"),
    (result("crazypad", "normal", verdict="unknown"), "unknown"),
    (result("crazypad", "normal", verdict="refused"), "refused"),
    (result("swarm", "none", verdict="refused"), "refused")])
def test_an_answer_is_in_the_words_of_its_rows_truths(diagnosed, answer):
    assert table.answer(diagnosed) == answer


def test_answers_are_counted_by_row_and_truth():
    results = [result("swarm", "none", verdict="none", condition="ns-34g"),
             result("swarm", "none", "gust", condition="ns-34g"),
             result("swarm", "none", verdict="none", condition="ns-67g"), result("authors", "none", verdict="none"),
             result("peers", "mass", "mass"), result("peers", "inertia", "inertia"), result("peers", "inertia", "mass")]
    assert table.counts(results) == {("swarm, ns-34g", "none"): {"none": 1, "gust": 1},
                                   ("swarm, ns-67g", "none"): {"none": 1}, ("authors", "none"): {"none": 1},
                                   ("peers", "any effect"): {"right": 2, "mass": 1}}


@pytest.mark.parametrize(("row", "truth", "word"), [("swarm", "none", "none"), ("peers", "any effect", "right")])
def test_a_line_has_hits_interval_and_answers_by_number(row, truth, word):
    ends = binomtest(3, 7).proportion_ci(method="wilson")
    assert table.line(row, truth, Counter({"gust": 1, word: 3, "mass": 2, "unknown": 1})) == \
        f"| {row} | {truth} | 3 of 7 [{ends.low:.0%}, {ends.high:.0%}] | {word} 3, mass 2, gust 1, unknown 1 |"


def test_the_time_is_that_of_nine_diagnoses_in_ten(capsys, tmp_path):
    table.print_table([{**result("authors", "none", verdict="none"), "seconds": float(s)} for s in range(11)], tmp_path)
    assert "11 diagnoses: 5 s in the middle, 9 s at most in nine of ten" in capsys.readouterr().out


def test_crazypads_drone_is_that_of_its_manifest(capsys, monkeypatch, tmp_path):
    (tmp_path / "crazypad").mkdir()
    (tmp_path / "crazypad/manifest.csv").write_text("file,drone,condition\na.csv.gz,E9,normal_flight\n")
    drones = []
    monkeypatch.setattr(table.crazypad, "interval", lambda pads, figure: drones.append(pads[0]["drone"]) or (0.0, 1.0))
    table.print_table([result("crazypad", "normal", verdict="none", condition="normal_flight")], tmp_path)
    assert set(drones) == {"E9"} and "CrazyPAD, 1 flights: family, balanced 1.00" in capsys.readouterr().out
