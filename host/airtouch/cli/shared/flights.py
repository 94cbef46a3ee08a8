"""The folder of recorded flights."""

import os
from pathlib import Path

import click

from airtouch.errors import AirTouchError
from airtouch.logs.files import MANIFEST


def find_flights() -> Path | None:
    """The folder of the authors' flights: AIRTOUCH_FLIGHTS or ../shared/flights, beside here or the checkout.

    Each may be that folder or one with an `airtouch` folder in it. None if there is none. Raises AirTouchError
    if AIRTOUCH_FLIGHTS names no folder.
    """
    named = os.environ.get("AIRTOUCH_FLIGHTS")
    if named:
        if not Path(named).is_dir():
            raise AirTouchError(f"AIRTOUCH_FLIGHTS={named}: no such folder")
        return _inner(Path(named))
    checkout = Path(__file__).resolve().parents[4]
    for beside in (Path.cwd().parent, checkout.parent):
        folder = beside / "shared" / "flights"
        if folder.is_dir():
            return _inner(folder)
    return None


def need_flights(folder: Path | None = None) -> Path:
    """The given folder, else that of `find_flights`. Raises a usage error if there is none."""
    chosen = folder or find_flights()
    if chosen is None:
        raise click.UsageError("no recorded flights found; name their folder or set AIRTOUCH_FLIGHTS")
    return chosen


def _inner(folder: Path) -> Path:
    return folder / "airtouch" if (folder / "airtouch" / MANIFEST).is_file() else folder
