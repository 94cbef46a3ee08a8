"""The exception that users see, and functions that prepare text for its message."""

import difflib
import functools
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import ParamSpec, TypeVar

_P = ParamSpec("_P")
_R = TypeVar("_R")
#: option of the command line, as messages have it -> argument of the Python functions
_ARGUMENTS = ((r"--force\b", "force=True"), (r"--speed ([\d.]*\d)", r"speed_mps=\1"),
              (r"--speed\b", "speed_mps"), (r"--detector ([\w-]+)", r'detector="\1"'),
              (r"--model\b", "model"), (r"--vehicle\b", "vehicle"))


class AirTouchError(ValueError):
    """Bad input. The message is one line with the file, the place in it and the remedy.

    The command line prints it without a traceback and exits with code 2.
    """


@contextmanager
def in_one_line(program: str) -> Iterator[None]:
    """For a program, `airtouch` or one in `tools`: an AirTouchError ends it with its line and exit code 2."""
    try:
        yield
    except AirTouchError as error:
        print(f"{program}: {error}", file=sys.stderr)
        sys.exit(2)


def python_words(text: str) -> str:
    """A message with the command line's options as arguments of the Python functions: `force=True` for `--force`."""
    for option, argument in _ARGUMENTS:
        text = re.sub(option, argument, text)
    return text


def in_python(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """The function for callers from Python: messages of its AirTouchErrors are in `python_words`."""
    @functools.wraps(function)
    def call(*arguments: _P.args, **options: _P.kwargs) -> _R:
        try:
            return function(*arguments, **options)
        except AirTouchError as error:
            error.args = (python_words(str(error)),)
            raise

    return call


def printable(text: str, most: int = 40) -> str:
    """At most `most` characters of a text from a file, with unprintable ones as escapes."""
    short = text if len(text) <= most else text[:most - 3] + "..."
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in short)


def nearest(name: str, known: Iterable[str]) -> str:
    """The text "; did you mean a or b?" with the known names similar to `name`; "" if there is none."""
    folded = {k.lower(): k for k in known}
    close = [folded[k] for k in difflib.get_close_matches(name.lower(), folded, 3)]
    return f"; did you mean {' or '.join(close)}?" if close else ""


def unknown(what: str, name: str, known: Iterable[str], more: str = "") -> AirTouchError:
    """The error for a name that is none of the known ones. more: what else may be given, as ", or a .toml file"."""
    known = list(known)
    return AirTouchError(f"no {what} {name!r}{nearest(name, known)} (known: {', '.join(known)}{more})")
