"""The table of `gap_real.py`: what counts as an answer, and its counts, on synthetic cases."""

from collections import Counter

import pytest
from scipy.stats import binomtest

from tools.diagnosis.recordings import table


def case(row, truth, *effects, verdict="effect", condition="", **more):
    """A case whose diagnosis names these effects."""
    return {"row": row, "truth": truth, "condition": condition, "verdict": verdict,
            "flight": "pad_normal_E8_log00.csv.gz", "effects": [{"name": e, "parameters": {}, **more} for e in effects]}


@pytest.mark.parametrize(("diagnosed", "answer"), [
    (case("swarm", "downwash", "downwash", "mass"), "downwash"),
    (case("swarm", "none", verdict="none"), "none"),
    (case("swarm", "downwash", verdict="unknown"), "unknown"),
    (case("fan", "comes and goes", "gust", seconds=[{"from_s": 4.0}]), "comes and goes"),
    (case("fan", "comes and goes", "gust", seconds=[]), "gust"),  # always there
    (case("fan", "comes and goes", "mass", seconds=[{"from_s": 4.0}]), "mass"),
    (case("peers", "mass", "thrust_coefficient"), "mass"),  # one thing in these logs
    (case("peers", "mass", "weak_motor"), "weak_motor"),
    (case("crazypad", "slung load", "slung_load"), "slung load"),
    (case("crazypad", "normal", verdict="none"), "normal")])
def test_an_answer_is_in_the_words_of_its_rows_truths(diagnosed, answer):
    assert table.answer(diagnosed) == answer


def test_answers_are_counted_by_row_and_truth():
    cases = [case("swarm", "none", verdict="none", condition="ns-34g"),
             case("swarm", "none", "gust", condition="ns-34g"),
             case("swarm", "none", verdict="none", condition="ns-67g"), case("authors", "none", verdict="none"),
             case("peers", "mass", "mass"), case("peers", "inertia", "inertia"), case("peers", "inertia", "mass")]
    assert table.counts(cases) == {("swarm, ns-34g", "none"): {"none": 1, "gust": 1},
                                   ("swarm, ns-67g", "none"): {"none": 1}, ("authors", "none"): {"none": 1},
                                   ("peers", "any effect"): {"right": 2, "mass": 1}}


@pytest.mark.parametrize(("row", "truth", "word"), [("swarm", "none", "none"), ("peers", "any effect", "right")])
def test_a_line_has_hits_interval_and_answers_by_number(row, truth, word):
    ends = binomtest(3, 7).proportion_ci(method="wilson")
    assert table.line(row, truth, Counter({"gust": 1, word: 3, "mass": 2, "unknown": 1})) == \
        f"| {row} | {truth} | 3 of 7 [{ends.low:.0%}, {ends.high:.0%}] | {word} 3, mass 2, gust 1, unknown 1 |"


def test_the_time_is_that_of_nine_diagnoses_in_ten(capsys, tmp_path):
    table.print_table([{**case("authors", "none", verdict="none"), "seconds": float(s)} for s in range(11)], tmp_path)
    assert "11 diagnoses: 5 s in the middle, 9 s at most in nine of ten" in capsys.readouterr().out
