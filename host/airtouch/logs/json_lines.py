"""JSON objects, one a line, to which a long run appends each result, so that it can go on where it stopped."""

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from airtouch.errors import AirTouchError
from airtouch.logs.files import read_text


def read(path: Path | None) -> list[dict[str, Any]]:
    """The objects of a file; none without a file. Raises AirTouchError, with the line, for anything else in it."""
    if path is None or not path.exists():
        return []
    objects = []
    for number, line in enumerate(read_text(path).splitlines(), 1):
        try:
            one = json.loads(line)
        except ValueError:
            one = None
        if not isinstance(one, dict):
            raise AirTouchError(f"{path}: line {number} is no JSON object; remove that line")
        objects.append(one)
    return objects


def append(path: Path | None, objects: Iterable[dict[str, Any]]) -> None:
    """Append objects to a file, which is made if it is not there; nothing without a path.

    A last line that a kill cut short stays a line of its own.
    """
    if path is not None:
        with path.open("ab+") as file:
            end = file.seek(0, os.SEEK_END)
            file.seek(max(end - 1, 0))
            if file.read(1) not in (b"", b"\n"):
                file.write(b"\n")
            file.writelines(json.dumps(one).encode() + b"\n" for one in objects)
