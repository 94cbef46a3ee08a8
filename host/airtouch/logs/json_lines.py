"""JSON objects, one a line, to which a long run appends each result, so that it can go on where it stopped."""

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from airtouch.errors import AirTouchError
from airtouch.logs.files import read_text


def read(path: Path | None) -> list[dict[str, Any]]:
    """The objects of a file; none without a file. A last line that a kill cut short is left out.

    Raises AirTouchError, with the line, for anything else in it.
    """
    if path is None or not path.exists():
        return []
    text = read_text(path)
    objects = []
    for number, line in enumerate(text[:_whole(text)].splitlines(), 1):
        one = _value(line)
        if not isinstance(one, dict):
            raise AirTouchError(f"{path}: line {number} is no JSON object; remove that line")
        objects.append(one)
    return objects


def append(path: Path | None, objects: Iterable[dict[str, Any]]) -> None:
    """Append objects to a file, which is made if it is not there; nothing without a path.

    A last line that a kill cut short is removed; another one without an end gets one.
    """
    if path is not None:
        with path.open("ab+") as file:
            end = file.seek(0, os.SEEK_END)
            file.seek(max(end - 1, 0))
            if file.read(1) not in (b"", b"\n"):
                file.seek(0)
                text = file.read().decode("latin-1")  # a character for each byte
                file.truncate(_whole(text))
                if _whole(text) == len(text):
                    file.write(b"\n")
            file.writelines(json.dumps(one).encode() + b"\n" for one in objects)


def _whole(text: str) -> int:
    """Characters of a text before its last line if that is the beginning of an object and has no end; else all."""
    begin = text.rfind("\n") + 1
    last = text[begin:]
    return begin if last.startswith("{") and _value(last) is None else len(text)


def _value(line: str) -> Any:
    """The value of a line of JSON; None for anything else."""
    try:
        return json.loads(line)
    except ValueError:
        return None
