"""The key of a sealed set: what acts in its flights, kept apart, and opened for one set of answers alone."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from airtouch.errors import AirTouchError
from airtouch.logs.files import write_bytes

SEALED, OPENED = "sealed.json", "opened.json"  #: files in the folder of a set: the key's hash; that of the answers


def key_of(folder: Path) -> Path:
    """Where the key of a set lies when nothing else is said: beside the folder."""
    return folder.resolve().with_name(folder.resolve().name + ".key.json")


def seal(folder: Path, key: Path, table: Mapping[str, Any], calibration_flights: int) -> None:
    """Write the key, and its SHA-256 into the folder of its set."""
    content = _json(table, indent=1)
    write_bytes(content, key, True)
    sealed = {"key_sha256": hashlib.sha256(content).hexdigest(), "flights": len(table["answers"]),
              "calibration_flights": calibration_flights}
    write_bytes(_json(sealed, indent=1), folder / SEALED, True)


def answers_sha256(cases: Sequence[Mapping[str, Any]]) -> str:
    """The hash of some diagnoses, by which it is known whether others were scored before."""
    return hashlib.sha256(json.dumps(cases, sort_keys=True).encode()).hexdigest()


def open_key(folder: Path, answers: str, key: Path | None = None) -> dict[str, Any]:
    """The key, if it is the one that was sealed; the first opening is recorded with the answers' hash.

    answers: `answers_sha256`. Raises AirTouchError for a key that was changed, and when other answers are already
    scored: who has seen the key cannot answer blindly.
    """
    folder, key = Path(folder), Path(key) if key else key_of(Path(folder))
    try:
        sealed = json.loads((folder / SEALED).read_text(encoding="utf-8"))["key_sha256"]
    except (OSError, ValueError, KeyError, TypeError):
        raise AirTouchError(f"{folder}: no sealed.json of a blind set; make one with "
                            "`airtouch gap blind make`") from None
    try:
        content = key.read_bytes()
    except OSError as error:
        raise AirTouchError(f"{key}: the key cannot be read: {error.strerror}; name it with --key") from None
    if hashlib.sha256(content).hexdigest() != sealed:
        raise AirTouchError(f"{key}: not the key that was sealed; its SHA-256 differs from the one in sealed.json")
    opened = folder / OPENED
    if opened.exists():
        if json.loads(opened.read_text(encoding="utf-8")).get("answers_sha256") != answers:
            raise AirTouchError(f"{opened}: the key was opened for other answers; make a new set to answer again")
    else:
        write_bytes(_json({"answers_sha256": answers}), opened, False)
    return json.loads(content)


def _json(table: Mapping[str, Any], indent: int | None = None) -> bytes:
    """A table as the bytes of a JSON file."""
    return (json.dumps(table, indent=indent) + "\n").encode()
