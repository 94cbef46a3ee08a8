"""Flights and vehicle that `airtouch gap` is given: files, folders, patterns."""

import filecmp
import glob
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path

import click

from airtouch import logs, vehicle
from airtouch.cli.shared.flights import flights_of_folder
from airtouch.errors import AirTouchError
from airtouch.logs.files import MANIFEST
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.formats.rosbag import is_bag
from airtouch.vehicle import Vehicle


class Flights:
    """Log files that are read as they are needed, one at a time, any number of times.

    Of several, those that cannot be read are left out, with their reason in `failed`; a
    single one raises AirTouchError.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self.paths = files_of(names)
        self.failed: dict[Path, str] = {}

    def __len__(self) -> int:
        return len(self.paths)

    def __iter__(self) -> Iterator[FlightLog]:
        for path in self.paths:
            try:
                log = logs.read(path)
            except AirTouchError as error:
                if len(self.paths) == 1:
                    raise
                self.failed[path] = str(error)
                continue
            yield log


def files_of(names: Sequence[str]) -> list[Path]:
    """Files named, logs in folders named, and what patterns match; each once, in order.

    Raises AirTouchError for a name that is none of these, and for a folder without a log.
    """
    files: dict[Path, None] = {}
    for name in names:
        path = Path(name)
        if path.is_dir() and is_bag(path):
            paths = [path]
        elif path.is_dir():
            paths = flights_of_folder(path)
        elif path.exists():
            if path.name == MANIFEST:  # which a shell's *.csv names too
                if len(names) == 1:
                    raise AirTouchError(f"{name}: a list of flights, not a flight; name its folder")
                continue
            paths = [path]
        else:
            paths = [Path(p)
                    for p in sorted(glob.glob(name, recursive=True)) if Path(p).is_file() and Path(p).name != MANIFEST]
        if not paths:
            raise AirTouchError(f"{name}: no such flight log; name a file, a folder of logs or a pattern")
        files.update(dict.fromkeys(paths))
    return list(files)


def also_in(flights: Flights, baseline: Flights) -> list[Path]:
    """The flights that are baseline flights as well: the same file, or a copy of one under another name."""
    return [path for path in flights.paths if any(_same(path, other) for other in baseline.paths)]


def _same(path: Path, other: Path) -> bool:
    """Whether two paths are one, or files of the same bytes, which are read only where their sizes are equal."""
    try:
        return path.resolve() == other.resolve() or filecmp.cmp(path, other, shallow=False)
    except OSError:
        return False


def vehicle_of(named: str | None, flights: Iterable[FlightLog], baseline: Iterable[FlightLog] = ()) -> Vehicle:
    """The vehicle named, else the one that the logs name, else the Crazyflie with flow deck.

    Raises AirTouchError where none is named and the logs, those of the baseline included, name two.
    """
    if named:
        return vehicle.load(named)
    craft, warning = vehicle.of_logs(chain(flights, baseline))
    if warning:
        click.echo(f"airtouch: {warning}", err=True)
    return craft
