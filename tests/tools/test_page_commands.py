"""Every command on a page, in a notebook and in a remedy is understood by the program that it names.

Nothing is run: the arguments go through the program's own parser.
"""

import argparse
import functools
import json
import re
import runpy
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import click
import pytest

from airtouch.cli import airtouch
from airtouch.errors import AirTouchError

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "host/docs"
PAGES = sorted([*ROOT.glob("*.md"), ROOT / "tools/README.md", *DOCS.glob("*.md"), *DOCS.glob("notebooks/*.ipynb")])
#: whose backticked commands are shown by `--help`, in remedies and in the headers of generated files
SOURCES = sorted(path for top in ("host/airtouch", "tools", "firmware", "gap8/app", "gap8/kernels")
                 for path in (ROOT / top).rglob("*") if path.suffix in (".py", ".sh", ".c", ".h", ".toml"))
PROGRAMS = r"(?:\.venv/bin/)?(?:airtouch|python3?|make|pip|uv|pytest|dask)"
NEWLINE = "\0"  #: of a command that goes on over several lines
PLACEHOLDER = re.compile(r"[A-Z][A-Z_0-9]*|\.\.\.")  #: for the reader to fill in: FLIGHTS, N


class Command(NamedTuple):
    """Words of one command, and whether it is to be typed as it is (in a block) or only mentioned (in a sentence)."""

    words: tuple[str, ...]
    typed: bool

    def __str__(self) -> str:
        return shlex.join(self.words)


def split(text: str, typed: bool) -> Iterator[Command]:
    """The commands of a line: those before and after pipes, `&&`, `;` and redirections, without comments."""
    lexer = shlex.shlex(text, posix=True, punctuation_chars=True)
    lexer.whitespace_split = True
    lexer.commenters = "#"
    words: list[str] = []
    for word in [*lexer, ";"]:
        if word.strip("&|;<>()"):
            words.append(word)
            continue
        while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):  # the environment
            words.pop(0)
        if words and re.fullmatch(PROGRAMS, words[0]):
            yield Command((words[0].removeprefix(".venv/bin/"), *words[1:]), typed)
        words = ["of a redirection"] if "<" in word or ">" in word else []


def commands(page: Path) -> list[Command]:
    """Those of a page's blocks and of its sentences."""
    text = page.read_text("utf-8")
    if page.suffix == ".ipynb":
        text = "\n\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"])
    block = re.compile(r"^```(\w*)\n(.*?)^```", re.S | re.M)
    commands_of_page, variables = [], {}
    for language, lines in block.findall(text) if page.suffix != ".py" else ():
        if language in ("", "sh", "bash"):
            joined = re.sub(r"\\\n\s*", " ", lines)
            joined = re.sub(r'-c ".*?"', lambda m: m.group().replace("\n", NEWLINE), joined, flags=re.S)
            for line in joined.split("\n"):
                assigned = re.match(r"([A-Z]+)=(\".*\"|'.*')\s*$", line)
                if assigned:
                    variables[f"${assigned[1]}"] = assigned[2].strip("\"'")
                line = functools.reduce(lambda a, b: a.replace(*b), variables.items(), line)
                if re.match(rf"\s*(\$ )?([A-Z_]+=\S* )*{PROGRAMS} \S", line):
                    commands_of_page += split(line.strip().removeprefix("$ "), True)
    for inline in re.findall(r"(?<!`)`([^`\n]+(?:\n[^`\n]+)?)`(?!`)", block.sub("", text)):
        if re.match(rf"([A-Z_]+=\S* )*{PROGRAMS} [\w.'/-]", inline) and not re.search(r"[{\\]", inline):
            commands_of_page += split(re.sub(r"\s*\n(//|#)?\s*", " ", inline), False)
    return commands_of_page


def understood_by_click(command: click.Command, arguments: list[str], typed: bool) -> None:
    """Raise click.UsageError if the command would: for options, values, and what is missing in a typed one."""
    context = click.Context(command)
    while isinstance(command, click.Group) and arguments and not arguments[0].startswith("-"):
        name, subcommand, arguments = command.resolve_command(context, arguments)
        assert subcommand is not None  # resolve_command raises for a name that it does not know
        command = subcommand
        context = click.Context(command, info_name=name, parent=context)
    values, rest, _ = command.make_parser(context).parse_args(list(arguments))
    if rest and not isinstance(command, click.Group):
        raise click.UsageError(f"unexpected: {rest}")
    for parameter in command.params:
        value = values.get(parameter.name)
        asked = any(p.name in values for p in command.params if p.is_eager)
        if typed and parameter.required and value in (None, (), []) and not asked:
            raise click.UsageError(f"missing: {parameter.name}")
        texts = [value] if isinstance(value, str) else value if isinstance(value, (list, tuple)) else ()
        if texts and not isinstance(parameter.type, (click.Path, click.File)) and not any(
                PLACEHOLDER.fullmatch(str(text)) for text in texts):
            parameter.type_cast_value(context, value)


class Understood(Exception):
    """The arguments fit, and the program would begin."""


def understood_by_tool(arguments: list[str], path: Path, typed: bool, monkeypatch, module: str = "") -> None:
    """Run a tool, as a script or as a module, up to the point where it has parsed its arguments.

    One that is mentioned without any only exists.
    """
    source = path.read_text("utf-8")
    assert re.search(r"argparse|import click|folder_and_part|import .*\bparser\b", source), f"{path} has no --help"
    if not any(arguments) and not typed:
        return

    def parsing(parse):
        def parse_and_stop(self, given=None, namespace=None):
            for action in self._actions:
                action.choices = action.choices and [*action.choices, *filter(PLACEHOLDER.fullmatch, arguments)]
            parse(self, given, namespace)
            raise Understood
        return parse_and_stop

    def main(self, *_, **__):
        understood_by_click(self, arguments, typed)
        raise Understood

    for name in ("parse_args", "parse_intermixed_args"):
        monkeypatch.setattr(argparse.ArgumentParser, name, parsing(getattr(argparse.ArgumentParser, name)))
    monkeypatch.setattr(click.Command, "main", main)
    monkeypatch.setattr(sys, "argv", [str(path), *arguments])
    monkeypatch.syspath_prepend(ROOT if module else path.parent)  # as Python does
    monkeypatch.delitem(sys.modules, module, raising=False)  # which another test has imported
    with pytest.raises(Understood):
        if module:
            runpy.run_module(module, run_name="__main__")
        else:
            runpy.run_path(str(path), run_name="__main__")


def understood_by_python(command: Command, page: Path, monkeypatch) -> None:
    """A script of the repository or of the page, a module, or a line of code."""
    first, *rest = command.words[1:]
    if first == "-c":
        compile(rest[0].replace(NEWLINE, "\n"), "page", "exec")
    elif first == "-m" and rest[0] in ("pytest", "pip"):
        understood(Command((rest[0], *rest[1:]), command.typed), page, monkeypatch)
    elif first == "-m" and re.match("(airtouch|tools)($|[.])", rest[0]):
        path = ROOT / ("host" if rest[0].startswith("airtouch") else "") / rest[0].replace(".", "/")
        path = path / "__main__.py" if path.is_dir() else path.with_suffix(".py")
        if rest[0] == "airtouch":
            understood(Command(("airtouch", *rest[1:]), command.typed), page, monkeypatch)
        else:
            understood_by_tool(rest[1:], path, command.typed, monkeypatch, rest[0])
    elif first.startswith("tools/"):
        understood_by_tool(rest, ROOT / first, command.typed, monkeypatch)
    elif first != "-m":
        assert f"`{first}`" in page.read_text("utf-8"), f"{first} is neither in the repository nor on the page"


@functools.cache
def recipe(words: tuple[str, ...]) -> str:
    """What make would do, with what the target needs first left out."""
    done = subprocess.run(["make", "-n", "-o", "setup", *words], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise click.UsageError(done.stderr.strip())
    return done.stdout


def understood_by_make(command: Command, page: Path, monkeypatch) -> None:
    """Its target is there, its recipe uses each variable, and what the recipe calls understands its arguments."""
    words = tuple("x" if word == "..." else word for word in command.words[1:] if word.strip("[]") == word)
    text = (ROOT / "Makefile").read_text("utf-8")
    unused = [w for w in words if "=" in w and not re.search(rf"\(.*\b{w.partition('=')[0]}\b", text)]
    assert not unused, unused
    for line in recipe(words).splitlines():
        called = re.match(r"\s*\.venv/bin/(airtouch|python -m tools|python tools/)", line)
        for part in split(line.rstrip("\\; "), False) if called and words[0] != "flash" else ():
            understood(part, page, monkeypatch)


def understood(command: Command, page: Path, monkeypatch) -> None:
    """Raise or fail if the program would not take these arguments."""
    program, *arguments = command.words
    if program == "airtouch":
        understood_by_click(airtouch, arguments, command.typed)
    elif program.startswith("python"):
        understood_by_python(command, page, monkeypatch)
    elif program == "make":
        understood_by_make(command, page, monkeypatch)
    elif program == "pytest":
        files = [word.partition("::")[0] for word in arguments if word.startswith("tests")]
        assert all((ROOT / file).exists() for file in files), files
    elif program == "dask":
        main = pytest.importorskip("distributed.cli.dask_" + arguments[0]).main
        understood_by_click(main, arguments[1:], command.typed)
    elif program in ("pip", "uv"):
        extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
        asked = {e for word in arguments for e in re.findall(r"^(?:airtouch|\.)\[(.*)\]$", word)}
        assert asked <= {*extras, "EXTRA"}, asked


def check(command: Command, page: Path, monkeypatch) -> None:
    """`understood`, with `...` as nothing or as a value, and a value for a mentioned option that ends a command."""
    without = tuple(word for word in command.words if word != "...")
    filled = tuple("1" if word == "..." else word for word in command.words)
    valued = (*without, "1") if not command.typed and without[-1].startswith("-") else without
    for words in {without, filled, valued}:
        with monkeypatch.context() as patches:
            try:
                understood(Command(words, command.typed), page, patches)
                return
            except (click.ClickException, AirTouchError, SystemExit) as error:
                reason = getattr(error, "message", error)
    pytest.fail(f"{page.relative_to(ROOT)}: {command}: {reason}")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_commands_of_a_page_are_understood(page, monkeypatch):
    for command in commands(page):
        check(command, page, monkeypatch)


def test_commands_in_help_and_remedies_are_understood(monkeypatch):
    for source in SOURCES:
        for command in commands(source):
            if command.words[0] != "python":
                check(command, source, monkeypatch)


def test_commands_are_found_in_the_pages():
    found = [command for page in PAGES for command in commands(page)]
    assert sum(command.typed for command in found) > 140 and len(found) > 280
    assert sum(command.words[:2] == ("airtouch", "gap") for command in found) > 30


@pytest.mark.parametrize("text, reason", [
    ("airtouch evaluate flights --sped 0.3", "No such option"),
    ("airtouch gap blind make OUT --flights many", "not a valid integer"),
    ("airtouch collect --uri udp://127.0.0.1:19850 --mission sweep", "missing: out"),
    ("airtouch simulate hover -n 2 --out o && airtouch gap diagnos o", "No such command"),
    ("python tools/gap_real.py F --rows swarms", "2"),
    ("python -m tools.instruction_counts.count --tolm", "2"),
    ("make fuzz TARGT=parser", "TARGT"),
    ("make fuzzy", "fuzzy"),
    ("make emulate CRAZYFLIE_BASE=x ARGS=--heigth", "heigth"),
    ("pip install 'airtouch[plot]'", "plot"),
    ("pytest tests/report/test_writ.py", "test_writ")])
def test_a_command_that_is_not_understood_fails(text, reason, monkeypatch, tmp_path):
    page = ROOT / "README.md"
    with pytest.raises((pytest.fail.Exception, AssertionError), match=reason):
        for command in split(text, True):
            check(command, page, monkeypatch)
