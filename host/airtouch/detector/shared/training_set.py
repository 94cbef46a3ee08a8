"""Which flights a model was trained on, so that a score of the same flights can say so."""

import hashlib
import os
from collections.abc import Mapping, Sequence
from typing import Any

from airtouch.logs.flight_log import ACC, ACC_WORLD, GYRO, PWM, FlightLog

DIGITS = 16  #: of a flight's hash


def of(flights: Sequence[FlightLog], start: Any = None) -> dict[str, Any]:
    """Metadata of a model: names and hashes of its training flights, after those of the model it started from."""
    before = start.metadata if start is not None else {}
    return {"flights_before": len(before.get("flights", ())),
            "flights": [*before.get("flights", ()), *(os.path.basename(log.source) for log in flights)],
            "flight_hashes": [*before.get("flight_hashes", ()), *(flight_hash(log) for log in flights)]}


def flight_hash(log: FlightLog) -> str:
    """Hexadecimal digits that are the same for the same motion, whatever the file's name or format.

    Over rates, motors and, where neither is logged, accelerations: six digits of each, so that a log written anew still
    counts as the same.
    """
    names = [name for name in (*GYRO, *PWM) if log.has(name)] or [n for n in (*ACC_WORLD, *ACC) if log.has(n)]
    total = hashlib.sha256()
    for name in names:
        total.update("".join(f"{value:.5e}," for value in log[name] + 0.0).encode())
    return total.hexdigest()[:DIGITS]


def contains(metadata: Mapping[str, Any], log: FlightLog) -> bool:
    """Whether a model with this metadata was trained on the flight: by hash; by name where a model has no hashes."""
    hashes = metadata.get("flight_hashes")
    if isinstance(hashes, list) and hashes:
        return flight_hash(log) in hashes
    return os.path.basename(log.source) in metadata.get("flights", ())
