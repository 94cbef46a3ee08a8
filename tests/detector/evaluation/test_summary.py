"""Scores of several models on the same flights, as one a flight."""

import warnings

import numpy as np
import pytest

from airtouch.detector.evaluation.data.dataset import Condition
from airtouch.detector.evaluation.score import EdgeScore, FlightScore
from airtouch.detector.evaluation.summary import one_a_flight, paired, summarise


def test_draws_of_a_flight_add_up():
    edge = EdgeScore("entry", 100, 110, "entry", -0.1, -0.03)
    score = FlightScore("a", Condition(), (edge,), (5,), 2, 30.0, (1, 2, 3, 4))
    both = one_a_flight([score, score, FlightScore("b", Condition(), (edge,), (), 1, 10.0)])
    assert [(s.file, len(s.edges), len(s.false), s.detections, s.airborne_s) for s in both] == [
        ("a", 2, 2, 4, 60.0), ("b", 1, 0, 1, 10.0)]
    assert both[0].windows == (2, 4, 6, 8)


def _scores(seed):
    rng = np.random.default_rng(seed)
    edges = [tuple(EdgeScore("entry", 100, 90, "entry", 0.1, float(e)) if e > 0 else EdgeScore("entry", 100)
                   for e in rng.normal(0.05, 0.05, 4)) for _ in range(12)]
    return [FlightScore(f"{i}", Condition(), e, tuple(range(rng.integers(0, 3))), 5, 30.0, (3, 4, 5, 9))
            for i, e in enumerate(edges)]


def test_two_equal_trainings_say_no_more_than_one():
    """Flights are drawn whole: the same scores twice leave figures and intervals as they are."""
    once = _scores(1)
    twice = one_a_flight([*once, *once])
    for name in ("mean_abs_error_m", "missed", "false_per_minute", "balanced_accuracy"):
        assert summarise(twice)[name] == pytest.approx(summarise(once)[name])
        assert summarise(twice)["intervals"][name] == pytest.approx(summarise(once)["intervals"][name])


def test_trainings_are_averaged_by_edge():
    first, second = _scores(1), _scores(2)
    distances = [abs(e.error_m) for s in (*first, *second) for e in s.edges if e.error_m is not None]
    assert summarise(one_a_flight([*first, *second]))["mean_abs_error_m"] == pytest.approx(np.mean(distances))


def test_flights_of_one_name_in_two_folders_are_two():
    scores = [FlightScore("f.csv", Condition(), (), (), 1, 10.0, path=path) for path in ("a/f.csv", "b/f.csv")]
    assert len(one_a_flight([*scores, *scores])) == 2
    assert len(one_a_flight([FlightScore.from_dict(score.as_dict()) for score in (*scores, *scores)])) == 2


def test_a_flight_is_one_however_its_path_is_typed(tmp_path, monkeypatch):
    (tmp_path / "a").mkdir()
    monkeypatch.chdir(tmp_path / "a")
    typed = [FlightScore("f.csv", Condition(), (), (), 1, 10.0, path=path)
             for path in ("f.csv", "./f.csv", "../a/f.csv", f"{tmp_path}/a/f.csv")]
    assert len(one_a_flight(typed)) == 1
    assert [score.as_dict()["path"] for score in typed][1:3] == ["./f.csv", "../a/f.csv"]


def test_flights_without_a_partner_are_reported():
    scores = _scores(1)

    def compare(first, second):
        return {"loss": first["missed"] - second["missed"]}

    with pytest.warns(UserWarning, match="2 of 22 scores"):
        assert paired(scores, scores[2:], compare)["loss"] == (0.0, 0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        paired(scores, scores[::-1], compare)


def test_false_edges_stay_unknown_where_no_score_knows_the_truth():
    blind = FlightScore("a", Condition(), (), None, 3, 60.0)
    assert one_a_flight([blind, blind])[0].false is None
    assert summarise(one_a_flight([blind, blind]))["false_per_minute"] is None


def test_hits_are_unknown_where_the_speed_of_a_detected_edge_is():
    detected, missed = EdgeScore("entry", 100, 110, "entry", -0.1, None), EdgeScore("exit", 500)
    table = summarise([FlightScore("a", Condition(), (detected, missed), (), 1, 30.0)])
    assert table["mean_abs_error_m"] is None and set(table["hit"].values()) == {None}
    assert table["missed"] == 0.5
    table = summarise([FlightScore("a", Condition(), (missed,), (), 1, 30.0)])
    assert set(table["hit"].values()) == {0.0}, "a missed edge is no hit, whatever the speed"
