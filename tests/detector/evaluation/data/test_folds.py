"""Which flights are held out together."""

from pathlib import Path

import pytest

from airtouch.detector.evaluation.data import folds
from airtouch.detector.evaluation.data.dataset import Condition, FlightFile, collect, day_of
from airtouch.errors import AirTouchError


def files(days: str) -> list[FlightFile]:
    return [FlightFile(Path(f"/flights/house/{i}.csv"), Condition(day=day)) for i, day in enumerate(days)]


def test_days_are_held_out_whole_in_even_groups():
    groups = folds.by_day(files("aaaabbbccdefg"))
    assert len(groups) == 5 and sum(map(len, groups.values())) == 13
    days = [{f.condition.day for f in members} for members in groups.values()]
    assert sum(map(len, days)) == len(set.union(*days)) == 7
    assert max(map(len, groups.values())) == 4


def test_the_authors_days_are_in_the_names(flights):
    groups = folds.by_day(collect([flights / "airtouch"]))
    days = {f.condition.day for members in groups.values() for f in members}
    assert days == {"0102", "0103", "0108", "0126", "0127", "0128", "0201"}
    assert day_of(Path("f0.csv.gz")) is None


def test_one_group_against_all_others():
    collection = files("aab")
    assert folds.only(collection, "b") == {0: collection[2:]}
    for group in ("house", "c"):
        with pytest.raises(AirTouchError, match="of 3 flights are of this folder or day"):
            folds.only(collection, group)


def test_flights_in_still_air_are_grouped_by_day_height_and_angle():
    flown = [Condition(day="0126", height=height, angle_deg=angle, wind=wind)
             for height, angle, wind in (("low", 0.0, "none"), ("h80", 0.0, "none"), ("low", 0.0, "low"),
                                         ("low", 30.0, "none"), ("low", 0.0, "none"), ("low", 0.0, None))]
    a, b, _, d, e, _ = collection = [FlightFile(Path(f"{i}.csv"), condition) for i, condition in enumerate(flown)]
    assert folds.still_air(collection) == {("0126", "low", "0"): [a, e], ("0126", "h80", "0"): [b],
                                           ("0126", "low", "30"): [d]}


def test_days_are_needed():
    with pytest.raises(AirTouchError, match="add a column 'day'"):
        folds.by_day([FlightFile(Path("f.csv"), Condition())])
    with pytest.raises(AirTouchError, match="at least two days"):
        folds.by_day(files("aaa"))


def test_a_flight_in_still_air_without_an_angle_has_a_group():
    file = FlightFile(Path("a.csv"), Condition(day="0126", height="low", wind="none"))
    assert folds.still_air([file]) == {("0126", "low", "None"): [file]}
