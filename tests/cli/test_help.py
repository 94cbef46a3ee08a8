"""Help teaches: every command has lines to copy, and each of them is understood."""

import re
import shlex
from contextlib import suppress

import click
import pytest

from airtouch.cli import COMMANDS, airtouch


def leaves(command, path=("airtouch",)):
    """(words, command) of every command without sub-commands."""
    context = click.Context(command)
    if not isinstance(command, click.Group):
        return [(path, command)]
    return [leaf for name in command.list_commands(context)
            for leaf in leaves(command.get_command(context, name), (*path, name))]


LEAVES = leaves(airtouch)


def help_of(path, command):
    return command.get_help(click.Context(command, info_name=" ".join(path)))


@pytest.mark.parametrize("path, command", LEAVES, ids=[" ".join(path) for path, _ in LEAVES])
def test_a_command_has_lines_to_copy_which_it_understands(path, command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sealed").mkdir()
    (tmp_path / "answers.json").touch()
    lines = [line.strip() for line in help_of(path, command).splitlines()
             if line.strip().startswith(" ".join(path) + " ") or line.strip() == " ".join(path)]
    assert lines, "no example"
    for line in lines:
        arguments = shlex.split(re.split(r"\s#|\s>", line)[0])[len(path):]
        with suppress(click.exceptions.Exit):  # of --list-effects and the like, which print and end
            assert command.make_context(path[-1], arguments).params


def test_the_first_page_names_every_command_in_a_whole_line():
    text = help_of(("airtouch",), airtouch)
    assert "..." not in text.split("\n", 1)[1]
    assert all(re.search(rf"^  {name} +\S", text, re.MULTILINE) for name in COMMANDS)
    gap = help_of(("airtouch", "gap"), airtouch.get_command(click.Context(airtouch), "gap"))
    assert "..." not in gap.split("\n", 1)[1] and "compare the" in gap


@pytest.mark.parametrize("path, command", LEAVES, ids=[" ".join(path) for path, _ in LEAVES])
def test_help_shows_no_range_without_bounds(path, command):
    assert "None]" not in help_of(path, command)
