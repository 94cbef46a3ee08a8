"""What commands and the scripts of tools share: a progress bar, the folder of recorded flights, options."""

import gc
import importlib
import weakref

import click
import pytest
from click.testing import CliRunner

from airtouch.cli import airtouch
from airtouch.cli.shared import flights
from airtouch.cli.shared.modules import loaded_for_good
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


def options_of(command):
    """(command's name, option) of every option of every command below."""
    if isinstance(command, click.Group):
        context = click.Context(command)
        return [pair for name in command.list_commands(context)
                for pair in options_of(command.get_command(context, name))]
    return [(command.name, p) for p in command.params if isinstance(p, click.Option)]


def taken(option, text):
    try:
        option.type.convert(text, option, None)
    except click.BadParameter:
        return False
    return True


def test_no_option_takes_a_number_that_is_not_finite():
    """With a heading that is NaN, `map` wrote an empty map."""
    numbers = [(name, o) for name, o in options_of(airtouch) if o.type.name.startswith("float")]
    assert {"map", "sitl", "collect", "evaluate"} <= {name for name, _ in numbers}
    assert [f"{name} {o.opts[0]} {text}" for name, o in numbers for text in ("nan", "inf") if taken(o, text)] == []


def test_no_seed_and_no_number_of_a_flight_is_negative():
    """NumPy's generator takes none below 0: it was a traceback."""
    drawn = [(name, o) for name, o in options_of(airtouch) if {"--seed", "--flight"} & {*o.opts}]
    assert {"sitl", "collect", "crossval", "ablate", "simulate", "train"} <= {name for name, _ in drawn}
    assert [name for name, o in drawn if taken(o, "-1") or not taken(o, "0")] == []


@pytest.mark.parametrize("arguments", [("simulate", "hover"), ("dataset", "fetch", "--from", ".")])
def test_a_bar_is_no_part_of_the_answer(arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(airtouch, [*arguments, "--out", "f"])
    (line,) = result.stdout.splitlines()
    assert line == "1 flight in f" or line.startswith("f: 0 new")


def test_garbage_is_looked_for_again_once_modules_are_loaded():
    """Also where a module fails to load, and among what comes later."""
    with pytest.raises(ImportError), loaded_for_good():
        importlib.import_module("airtouch.no_such_module")
    assert gc.isenabled()

    class Node:
        """It refers to itself, so that only a search finds it to be garbage."""

        def __init__(self) -> None:
            self.itself = self

    node = Node()
    alive = weakref.ref(node)
    del node
    gc.collect()
    assert alive() is None
