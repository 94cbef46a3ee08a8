"""What commands and the scripts of tools share: a bar of how many items are done, the folder of recorded flights."""

import pytest

from airtouch.cli.shared import flights
from airtouch.cli.shared.progress import with_bar
from airtouch.errors import AirTouchError


def test_every_item_comes_once_and_the_bar_says_how_many_are_done(capsys):
    assert list(with_bar(["a", "b", "c"], "letters")) == ["a", "b", "c"]
    printed = capsys.readouterr()
    assert "letters" in printed.err and "3/3" in printed.err and printed.out == ""


def test_the_bar_of_an_unfinished_run_does_not_say_that_all_is_done(capsys):
    items = with_bar(["a", "b", "c"], "letters")
    with pytest.raises(ZeroDivisionError):
        for item in items:
            1 / (item != "b")
    items.close()
    assert "1/3" in capsys.readouterr().err


def test_without_recorded_flights_it_says_what_to_do(monkeypatch):
    monkeypatch.delenv("AIRTOUCH_FLIGHTS", raising=False)
    monkeypatch.setattr(flights, "_beside", lambda: None)
    with pytest.raises(AirTouchError, match="no recorded flights found; name their folder or set AIRTOUCH_FLIGHTS"):
        flights.need_flights()
