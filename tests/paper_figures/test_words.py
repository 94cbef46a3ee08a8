"""When an error counts as reached."""

import numpy as np

from airtouch.detector.evaluation.data.dataset import Condition
from airtouch.detector.evaluation.score import score_flight
from airtouch.detector.evaluation.summary import summarise
from airtouch.detector.trace import Trace
from airtouch.paper_figures import words


def row(error, low, missed, high=9.0, edges=20):
    return {"edges": edges, "mean_abs_error_m": error, "missed": missed,
            "intervals": {"mean_abs_error_m": low and (low, high), "missed": (missed, missed)}}


def test_an_error_is_reached_by_a_narrow_interval_and_with_few_misses_alone():
    assert words.reaches(row(0.03, 0.029, 0.05, 0.033), 0.03) is True
    assert words.reaches(row(0.04, 0.029, 0.05), 0.03) is None  # the interval ends at 9 m: anything may be true
    assert words.reaches(row(0.04, 0.031, 0.05), 0.03) is False
    assert words.reaches(row(0.01, 0.005, 0.66, 0.02), 0.03) is False
    assert words.reaches(row(None, None, 1.0), 0.03) is False
    assert words.reaches(row(0.02, None, 0.0), 0.03) is None  # of one flight


def test_flights_without_an_edge_decide_nothing():
    scores = [score_flight("f.csv", Condition(), [], np.ones(500, dtype=bool), Trace(np.zeros(500), []), 0.0)]
    assert words.reaches(summarise(scores), 0.03) is None


def test_two_wide_intervals_are_not_the_same():
    first = row(0.03, 0.029, 0.0, 0.031)
    assert words.worse(first, row(0.05, 0.045, 0.0, 0.055)) is True
    assert words.worse(first, row(0.03, 0.029, 0.5, 0.031)) is True
    assert words.worse(first, row(0.03, 0.028, 0.0, 0.032)) is False
    assert words.worse(first, row(0.03, 0.001, 0.0, 0.09)) is None
    assert words.worse(first, row(0.03, None, 0.0)) is None


def test_an_unknown_number_of_false_edges_is_no_zero():
    known = {**row(0.02, 0.01, 0.0), "edges": 4}
    known["intervals"]["missed"] = None
    assert words.score({**known, "false_per_minute": 0.0}).endswith(", 0.0 false a minute")
    assert words.score({**known, "false_per_minute": None}).endswith(", - false a minute")
