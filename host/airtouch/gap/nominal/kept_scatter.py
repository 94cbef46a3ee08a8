"""The scatter of a baseline, kept on disk from one diagnosis to the next.

It takes up to two fifths of a diagnosis, and depends on the baseline alone: who flies, diagnoses and flies again
need not wait for it twice.
"""

import hashlib
import json
import os
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, fields
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.gap.flights.flight import Flight
from airtouch.gap.signatures.candidates import all_candidates
from airtouch.gap.signatures.scatter import Scatter
from airtouch.logs.files import write_bytes
from airtouch.simulation.effects import NAMES
from airtouch.vehicle import Vehicle

VARIABLE = "AIRTOUCH_CACHE"  #: environment variable: the folder that scatters are kept in; empty: none is kept
MOST = 100  #: scatters that are kept, of some 5 kB each; the oldest go first
CODE = ("*.py", "*.toml", "*.npz", "*.so", "*.pyd")  #: files of the package that results depend on
LIBRARIES = ("numpy", "scipy", "numba")


def kept_scatter(vehicle: Vehicle, flights: Sequence[Flight], without: Sequence[str], measure: Callable[[], Scatter],
                 ) -> Scatter:
    """What `measure` returns, or what it returned before for the same vehicle, flights, effects left out and code.

    Nothing is kept where an effect of the user's own is a candidate, as its code may change, or where the folder cannot
    be written.
    """
    folder = folder_of(os.environ)
    if folder is None or not set(all_candidates(without)) <= set(NAMES):
        return measure()
    path = folder / f"scatter-{digest_of(vehicle, flights, without)}.json"
    try:
        return scatter_from(path.read_bytes())
    except (OSError, ValueError):
        scatter = measure()
    with suppress(OSError, AirTouchError):
        folder.mkdir(parents=True, exist_ok=True)
        write_bytes(json.dumps(asdict(scatter), default=np.ndarray.tolist).encode(), path, force=True)
        by_age = sorted(folder.glob("scatter-*.json"), key=lambda p: p.stat().st_mtime)
        for old in by_age[:-MOST]:
            old.unlink(missing_ok=True)
    return scatter


def folder_of(environment: Mapping[str, str]) -> Path | None:
    """The folder of kept scatters: that of VARIABLE, else `airtouch` in the user's cache; None where none is kept."""
    chosen = environment.get(VARIABLE)
    if chosen is not None:
        return Path(chosen) if chosen else None
    try:
        return Path(environment.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "airtouch"
    except RuntimeError:  # nobody knows where home is
        return None


def scatter_from(data: bytes) -> Scatter:
    """The scatter that a file holds; ValueError where these are no bytes of one."""
    try:
        raw = json.loads(data)
        return Scatter(
            rms={n: _numbers(v) for n, v in raw["rms"].items()}, freedom=float(raw["freedom"]), rate=_pair(raw["rate"]),
            passing={n: _pair(v) for n, v in raw["passing"].items()}, vehicle=str(raw["vehicle"]),
            middle={n: _numbers(v) for n, v in raw["middle"].items()}, exact=bool(raw["exact"]))
    except (KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        raise ValueError(f"no scatter: {error}") from error


def _numbers(values: Any) -> np.ndarray:
    """One or more numbers (k,); ValueError or TypeError for anything else."""
    numbers = np.array([float(v) for v in values])
    if not len(numbers):
        raise ValueError("no number")
    return numbers


def _pair(values: Any) -> tuple[float, float]:
    """Two numbers."""
    one, other = values
    return float(one), float(other)


def digest_of(vehicle: Vehicle, flights: Sequence[Flight], without: Sequence[str]) -> str:
    """A name that is another one where anything differs that the scatter of these flights depends on."""
    digest = hashlib.sha256(code_digest())
    firmware = Path(vehicle.firmware)  # a release's name, or a file of its own
    digest.update(repr((vehicle, sorted(without), firmware.read_bytes() if firmware.is_file() else b"")).encode())
    for flight in flights:
        for part in _parts(flight):
            digest.update(repr(part).encode() if not isinstance(part, np.ndarray)
                          else repr((part.shape, part.dtype)).encode() + np.ascontiguousarray(part).tobytes())
    return digest.hexdigest()[:32]


def _parts(flight: Flight) -> Iterator[Any]:
    """All that a flight holds: arrays and what can be printed."""
    for field in fields(flight):
        if field.compare and field.name != "log":
            yield getattr(flight, field.name)
    yield sorted(flight.log.meta.items(), key=str)
    for name, values in flight.log.columns.items():
        yield name
        yield values


@cache
def code_digest() -> bytes:
    """Digest of the package's files, and of the versions of what it works with."""
    package = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256(repr((platform.machine(), platform.python_version(),
                                  *(version(name) for name in LIBRARIES))).encode())
    for path in sorted(p for pattern in CODE for p in package.rglob(pattern)):
        digest.update(str(path.relative_to(package)).encode() + path.read_bytes())
    return digest.digest()
