"""Effects of a user's own, from the text of a Python file; what is wrong in it is said in a line."""

import dataclasses
import re
import sys
import threading
import traceback
from pathlib import Path

from airtouch.errors import AirTouchError, nearest
from airtouch.logs.files import read_text
from airtouch.simulation.effects import names
from airtouch.simulation.effects.effect import Effect, Parameter
from airtouch.simulation.effects.registry import EFFECTS, LOADED, SOURCE, register

_LOCK = threading.RLock()  #: held from the look whether a text is loaded until it is; a file may load another one


def load_file(path: str | Path) -> list[Effect]:
    """Register every `Effect` that a Python file defines at its top level, and return them.

    Raises AirTouchError for a file that is not there or no text.
    """
    if not Path(path).is_file():
        raise AirTouchError(f"{path}: no such file of effects")
    loaded = load_text(read_text(path), str(path))
    SOURCE.update(dict.fromkeys((e.name for e in loaded), str(path)))
    return loaded


def load_text(text: str, source: str = "effect file") -> list[Effect]:
    """Register the effects of Python source; a second time with the same text, of any thread, changes nothing."""
    key = hash(text)
    with _LOCK:
        if key not in LOADED:
            LOADED[key] = [register(e) for e in _defined(text, source)]
        return LOADED[key]


def _defined(text: str, source: str) -> list[Effect]:
    """The effects that Python source defines, not yet registered. Raises AirTouchError that says what is wrong."""
    scope: dict[str, object] = {"__name__": "airtouch_effects"}
    try:
        names.check(text, source)
        exec(compile(text, source, "exec"), scope)
    except AirTouchError:
        raise
    except Exception as error:
        raise AirTouchError(f"{source}{_line_of(error, source)}: {_in_words(error)}") from None
    defined = [v for v in scope.values() if isinstance(v, Effect)]
    if not defined:
        raise AirTouchError(f"{source}: defines no Effect")
    names_of_file = [e.name for e in defined]
    for name in names_of_file:
        if name in EFFECTS or names_of_file.count(name) > 1:
            raise AirTouchError(f"{source}: an effect named {name!r} is already there; give yours another name")
    return defined


def source_of(name: str) -> str:
    """The file that an effect of a user's own was loaded from, "" for one of the package."""
    return SOURCE.get(name, "")


def _in_words(error: Exception) -> str:
    """The error in a line, with the nearest right names where a name was wrong."""
    text = str(error).splitlines()[0]
    if missing := re.match(r"cannot import name '(\w+)' from '([\w.]+)'", text):
        name, module = missing.groups()
        return f"{module} has no {name!r}{nearest(name, vars(sys.modules[module]))}"
    if argument := re.match(r"(\w+)\.__init__\(\) got an unexpected keyword argument '(\w+)'", text):
        kind, name = argument.groups()
        known = {"Effect": Effect, "Parameter": Parameter}.get(kind)
        if known:
            return f"{kind} takes no {name!r}{nearest(name, [f.name for f in dataclasses.fields(known)])}"
    return f"{type(error).__name__}: {text}"


def _line_of(error: Exception, source: str) -> str:
    """`:12`, the line of the file in which an error was raised, "" where it is not known."""
    if isinstance(error, SyntaxError):
        return f":{error.lineno}" if error.lineno else ""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == source]
    return f":{lines[-1]}" if lines else ""
