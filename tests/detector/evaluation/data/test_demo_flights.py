"""The demo's flights are split by fold, held-out flights are in no way trained on, and conditions stay in."""

from pathlib import Path

import pytest

from airtouch.detector.evaluation.data import demo_flights
from airtouch.detector.evaluation.data.dataset import Condition, FlightFile
from airtouch.errors import AirTouchError


def files(folds):
    return [FlightFile(Path(f"{i}.csv"), Condition(fold=fold)) for i, fold in enumerate(folds)]


def test_whole_folds_are_held_out():
    train, test = demo_flights.split(files([0, 1, 2, 3, 4, 0, 1, 2, 3, 4]))
    assert {f.condition.fold for f in test} == {0, 4} and {f.condition.fold for f in train} == {1, 2, 3}
    assert len(train) + len(test) == 10


def test_flights_without_folds_are_held_out_by_place():
    train, test = demo_flights.split(files([None] * 9))
    assert [f.path.stem for f in test] == ["0", "4", "8"]
    assert [f.path.stem for f in train] == ["1", "2", "3", "5", "6", "7"]


def test_a_choice_is_spread_over_the_whole_list():
    assert demo_flights.spread(list(range(100)), 4) == [0, 25, 50, 75]
    assert demo_flights.spread([1, 2], 4) == [1, 2]


def test_each_simulated_flight_is_told(monkeypatch, tmp_path):
    monkeypatch.setattr(demo_flights, "GENERATED", 3)
    counts = []
    flights = demo_flights.simulate_flights(tmp_path, progress=lambda *count: counts.append(count))
    assert counts == [(0, 3), (1, 3), (2, 3), (3, 3)] and len(flights) == 3


def test_too_few_flights_are_told(monkeypatch, tmp_path):
    monkeypatch.setattr(demo_flights.dataset, "collect", lambda folders, speed: files([0, 1, 2]))
    with pytest.raises(AirTouchError, match="3 flights are too few"):
        demo_flights.choose(tmp_path, tmp_path / "simulated")


@pytest.mark.parametrize("every, left", [((1, 1, 2, 3), "test"), ((0, 0, 4, 8), "train")])
def test_folds_that_leave_none_to_train_or_to_test_are_told(monkeypatch, tmp_path, every, left):
    monkeypatch.setattr(demo_flights.dataset, "collect", lambda folders, speed: files(every))
    with pytest.raises(AirTouchError, match=f"no flight is left to {left} on"):
        demo_flights.choose(tmp_path, tmp_path / "simulated")


def test_no_training_flight_is_one_line():
    with pytest.raises(AirTouchError, match="no flight to train on"):
        demo_flights.readable([])
