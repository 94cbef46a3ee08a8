"""Answers to a sealed set: diagnoses as JSON, read and checked before the key is opened for them."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from airtouch.errors import AirTouchError

Answer = Mapping[str, Any]  #: a diagnosis as JSON


def read_answers(path: Path) -> list[Answer]:
    """Diagnoses from a folder of JSON files, one each, or a file of many (`diagnose --each --json`).

    Raises AirTouchError for what is none or cannot be read.
    """
    path = Path(path)
    files = sorted(path.glob("*.json")) if path.is_dir() else [path]
    out: list[Answer] = []
    for file in files:
        try:
            table = json.loads(file.read_text(encoding="utf-8"))
            out += table["cases"] if "cases" in table else [table]
        except OSError as error:
            raise AirTouchError(f"{file}: cannot be read: {error.strerror}") from None
        except (ValueError, TypeError):
            raise AirTouchError(f"{file}: not the JSON of a diagnosis; write it with `diagnose --json`") from None
    if not out:
        raise AirTouchError(f"{path}: no diagnosis in it (*.json)")
    for case in out:
        if not isinstance(case, dict) or not case.get("flights") or not case.get("ranking"):
            raise AirTouchError(f"{path}: a diagnosis without `flights` or `ranking`")
    return out


def flight_of(case: Answer) -> str:
    """Name of the flight of a diagnosis, without folder and endings.

    Raises AirTouchError for a diagnosis of several flights.
    """
    if len(case["flights"]) > 1:
        raise AirTouchError(f"one diagnosis of {len(case['flights'])} flights, {case['flights'][0]} and others; a "
                            "sealed set is scored by one of each flight (`diagnose --each`)")
    return Path(case["flights"][0]).name.split(".")[0]


def flights_in(folder: Path) -> list[str]:
    """Names of the flights of a sealed set, in order, without their endings."""
    return sorted(p.name.removesuffix(".csv.gz") for p in Path(folder).glob("flight_*.csv.gz"))


def check_answers(cases: Sequence[Answer], flights: Sequence[str]) -> None:
    """Raise AirTouchError unless each of the flights has one diagnosis, and each diagnosis has what a score reads.

    A key is opened once: answers to another set, or a file that cannot be scored, would waste it. Diagnoses with
    effects left out may be of any of the flights.
    """
    counts = Counter(flight_of(c) for c in cases if not c.get("without"))
    for name in [*counts, *(flight_of(c) for c in cases)]:
        if name not in flights:
            raise AirTouchError(f"{name}: diagnosed, but not a flight of this set")
        if counts[name] > 1:
            raise AirTouchError(f"{name}: diagnosed {counts[name]} times; the set is scored by one answer to each")
    missing = [name for name in flights if not counts[name]]
    if missing:
        raise AirTouchError(f"{missing[0]}: not diagnosed ({len(missing)} of {len(flights)} flights are not); the key "
                            "is opened for answers to all")
    for case in cases:
        if not _can_be_scored(case):
            raise AirTouchError(f"{flight_of(case)}: a diagnosis without all of `verdict`, `effects` (name, "
                                "parameters), `ranking` (name, probability) and, of an effect, `gap` (before, after)")


def _can_be_scored(case: Answer) -> bool:
    """Whether a diagnosis has every field that a score reads, of the right type."""
    try:
        numbers = [r["probability"] for r in case["ranking"]] + [r["nats"] for r in case["ranking"] if "nats" in r]
        names = [case["verdict"], *(r["name"] for r in case["ranking"]), *(e["name"] for e in case["effects"])]
        for effect in case["effects"]:
            for quantity in effect["parameters"].values():
                numbers += [quantity[k] for k in ("value", "low", "high")] if "low" in quantity else []
        gaps = [case["gap"]] if case["verdict"] == "effect" else []
        numbers += [gap[k] for gap in (*gaps, *filter(None, [case.get("control")])) for k in ("before", "after")]
    except (KeyError, TypeError, AttributeError):
        return False
    return all(isinstance(x, int | float) for x in numbers) and all(isinstance(x, str) for x in names)
