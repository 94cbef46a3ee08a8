"""The key of a sealed set: what acts in its flights, kept apart, and opened for one set of answers alone."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from airtouch.errors import AirTouchError
from airtouch.logs.files import write_bytes

SEALED, OPENED = "sealed.json", "opened.json"  #: files in the folder of a set: the key's hash; that of the answers
ANSWERS = "answers"  #: folder in it that `run` writes the diagnoses to


@dataclass(frozen=True)
class DrawnEffect:
    """An effect that acts in a flight: name in the registry, kind and severity as drawn, values of its parameters.

    level: place of the severity, from 0, the weakest, to 2; values: in the parameters' units.
    """

    name: str
    kind: str
    level: int
    values: Mapping[str, float]


@dataclass(frozen=True)
class DrawnFlight:
    """What acts in a flight.

    nats: `severity.log_ratio`, by a test that knows effect and values; None where not one effect acts.
    """

    effects: tuple[DrawnEffect, ...]
    nats: float | None = None

    def plain(self) -> dict[str, Any]:
        """JSON-ready."""
        return {"effects": [asdict(e) for e in self.effects], **({} if self.nats is None else {"nats": self.nats})}


@dataclass(frozen=True)
class Key:
    """The key of a set: what acts in each of its flights, by name, and how the set was drawn.

    severities: of each kind of effect, its three strengths in rising order; drawn: the other fields of the file, a salt
    among them, so that nobody can guess the key from its hash.
    """

    flights: Mapping[str, DrawnFlight]
    severities: Mapping[str, Sequence[float]] = field(default_factory=dict)
    drawn: Mapping[str, Any] = field(default_factory=dict)

    def plain(self) -> dict[str, Any]:
        """JSON-ready, as the file has it."""
        return {**self.drawn, "severities": {k: list(v) for k, v in self.severities.items()},
                "answers": {name: flight.plain() for name, flight in self.flights.items()}}


def key_from(table: Mapping[str, Any]) -> Key:
    """The key of a file's content; undoes `Key.plain`."""
    flights = {name: DrawnFlight(tuple(DrawnEffect(**e) for e in one["effects"]), one.get("nats"))
               for name, one in table["answers"].items()}
    drawn = {k: v for k, v in table.items() if k not in ("answers", "severities")}
    return Key(flights, table.get("severities", {}), drawn)


def key_path(folder: Path) -> Path:
    """Where the key of a set lies by default: beside the set's folder."""
    return folder.resolve().with_name(folder.resolve().name + ".key.json")


def seal(folder: Path, path: Path, key: Key, calibration_flights: int) -> None:
    """Write the key to a path, and its SHA-256 into the folder of its set."""
    content = _json(key.plain(), indent=1)
    write_bytes(content, path, True)
    sealed = {"key_sha256": hashlib.sha256(content).hexdigest(), "flights": len(key.flights),
              "calibration_flights": calibration_flights}
    write_bytes(_json(sealed, indent=1), folder / SEALED, True)


def sealed_in(folder: Path) -> dict[str, Any]:
    """What `seal` wrote into the folder of a set; raises AirTouchError where it is not there."""
    try:
        sealed = json.loads((folder / SEALED).read_text(encoding="utf-8"))
        return {"key_sha256": sealed["key_sha256"], "flights": sealed["flights"]}
    except (OSError, ValueError, KeyError, TypeError):
        raise AirTouchError(f"{folder}: no sealed.json of a blind set; make one with "
                            "`airtouch gap blind make`") from None


def sealed_key(folder: Path, key: Path | None = None) -> bytes:
    """Content of the key's file, which is the one that was sealed; it is not opened by that.

    key: its path, beside the folder by default. Raises AirTouchError for a key that was changed or cannot be read.
    """
    key, sealed = Path(key) if key else key_path(folder), sealed_in(folder)["key_sha256"]
    try:
        content = key.read_bytes()
    except OSError as error:
        raise AirTouchError(f"{key}: the key cannot be read: {error.strerror}; name it with --key") from None
    if hashlib.sha256(content).hexdigest() != sealed:
        raise AirTouchError(f"{key}: not the key that was sealed; its SHA-256 differs from the one in sealed.json")
    return content


def answers_sha256(cases: Sequence[Mapping[str, Any]]) -> str:
    """The hash of some diagnoses, by which it is known whether others were scored before."""
    return hashlib.sha256(json.dumps(cases, sort_keys=True).encode()).hexdigest()


def open_key(folder: Path, answers: str, key: Path | None = None) -> Key:
    """The key, if it is the one that was sealed; the first opening is recorded with the answers' hash.

    answers: `answers_sha256`; key: its path, beside the folder by default. Raises AirTouchError for a key that was
    changed or cannot be read, and when other answers are already scored: who has seen the key cannot answer blindly.
    """
    folder = Path(folder)
    content, opened = sealed_key(folder, key), folder / OPENED
    if opened.exists():
        try:
            scored = json.loads(opened.read_text(encoding="utf-8"))["answers_sha256"]
        except (OSError, ValueError, KeyError, TypeError):
            raise AirTouchError(f"{opened}: damaged, so nobody knows which answers the key was opened for; make a new "
                                "set to answer again") from None
        if scored != answers:
            raise AirTouchError(f"{opened}: the key was opened for other answers; make a new set to answer again")
    else:
        write_bytes(_json({"answers_sha256": answers}), opened, False)
    return key_from(json.loads(content))


def _json(table: Mapping[str, Any], indent: int | None = None) -> bytes:
    """A table as the bytes of a JSON file."""
    return (json.dumps(table, indent=indent) + "\n").encode()
