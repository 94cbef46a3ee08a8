"""Which flights a model was trained on, so that a score of the same flights can say so."""

import hashlib
import os
from collections.abc import Mapping, Sequence
from typing import Any

from airtouch.logs.flight_log import ACC, ACC_WORLD, GYRO, PWM, FlightLog

DIGITS = 16  #: hexadecimal digits of a flight's hash: 64 bits


def of(flights: Sequence[FlightLog], start: Any = None, free_air: Sequence[FlightLog] = ()) -> dict[str, Any]:
    """Metadata of a model: names and hashes of its training flights, after those of the model it started from.

    free_air: flights without edges that it learns silence from; `free_air` is their number without those of `start`.
    """
    before = start.metadata if start is not None else {}
    return {"flights_before": len(before.get("flights", ())),
            "flights": [*before.get("flights", ()), *(os.path.basename(log.source) for log in flights)],
            "flight_hashes": [*before.get("flight_hashes", ()), *(flight_hash(log) for log in flights)],
            "free_air": len(free_air),
            "free_air_hashes": [*before.get("free_air_hashes", ()), *(flight_hash(log) for log in free_air)]}


def flight_hash(log: FlightLog) -> str:
    """Hash of a flight's motion, DIGITS hexadecimal digits: the same whatever the file's name or format.

    It covers rates and motors, or accelerations where neither is logged, to six digits each: a log that is written
    anew with the same columns of these has the same hash. One that lacks a column of them has another.
    """
    names = [name for name in (*GYRO, *PWM) if log.has(name)] or [n for n in (*ACC_WORLD, *ACC) if log.has(n)]
    total = hashlib.sha256()
    for name in names:
        total.update("".join(f"{value:.5e}," for value in log[name] + 0.0).encode())
    return total.hexdigest()[:DIGITS]


def contains(metadata: Mapping[str, Any], log: FlightLog) -> bool:
    """Whether a model with this metadata was trained on the flight: by hash; by name where a model has no hashes.

    Flights in free air count too. Models of before 2026-11-27, the shipped ones among them, do not say which they were.
    A flight is not recognised from a log that holds more or fewer of rates and motors than the one trained on.
    """
    hashes, free_air = metadata.get("flight_hashes") or [], metadata.get("free_air_hashes") or []
    if (hashes or free_air) and flight_hash(log) in {*hashes, *free_air}:
        return True
    return not hashes and os.path.basename(log.source) in metadata.get("flights", ())
