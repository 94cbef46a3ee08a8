"""Folders of recorded flights."""

import os
from pathlib import Path

import click

from airtouch.errors import AirTouchError
from airtouch.logs.files import MANIFEST, flights_in, ignored


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
    folder = _beside()
    return None if folder is None else _inner(folder)


def need_flights(folder: Path | None = None) -> Path:
    """The given folder, else that of `find_flights`. Raises AirTouchError if there is none."""
    chosen = folder or find_flights()
    if chosen is None:
        raise AirTouchError("no recorded flights found; name their folder or set AIRTOUCH_FLIGHTS")
    return chosen


def data_folder(data_set: str = "") -> Path:
    """The folder of a recorded data set, or of all of them, in AIRTOUCH_FLIGHTS or ../shared/flights.

    The latter is looked for as by `find_flights`. The folder need not exist: `check_data_set` tells.
    """
    return Path(os.environ.get("AIRTOUCH_FLIGHTS") or _beside() or "../shared/flights") / data_set


def flights_of_folder(folder: Path) -> list[Path]:
    """The flight logs of a folder, as `files.flights_in`. Says on stderr how many of its files are none."""
    flights, others = flights_in(folder), ignored(folder)
    if others:
        click.echo(f"airtouch: {folder}: {others} other {'file' if others == 1 else 'files'} in this folder, "
                   "by name and content no flight logs", err=True)
    return flights


def check_data_set(folder: Path, *tables: str) -> None:
    """Raise AirTouchError where a data set's folder lacks its manifest.csv or another of its tables."""
    for name in (MANIFEST, *tables):
        if not (folder / name).is_file():
            raise AirTouchError(f"{folder} has no {name}: give the folder of the flights, or set AIRTOUCH_FLIGHTS")


def _beside() -> Path | None:
    """The folder shared/flights beside here or beside the checkout; None where neither has one."""
    checkout = Path(__file__).resolve().parents[4]
    folders = (beside / "shared" / "flights" for beside in (Path.cwd().parent, checkout.parent))
    return next((folder for folder in folders if folder.is_dir()), None)


def _inner(folder: Path) -> Path:
    return folder / "airtouch" if (folder / "airtouch" / MANIFEST).is_file() else folder
