"""Which flights, under which conditions: `manifest.csv` beside them."""

import csv
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from airtouch.errors import AirTouchError
from airtouch.logs.files import MANIFEST, flights_in, in_folder
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.formats.rosbag import is_bag

MOST_MPS = 100.0  #: m/s, above any commanded speed


@dataclass(frozen=True)
class Condition:
    """How a flight was flown; None where it is not known.

    use: "clean" or "messy". fold: cross-validation fold. height: class of height
    over the platform. angle_deg: between the path and the edge's normal. wind:
    where a fan blew. speed_mps: commanded speed, turns seconds into metres.
    day: when it was flown; flights of one day share battery, tape and trim.
    """

    use: str | None = None
    fold: int | None = None
    height: str | None = None
    angle_deg: float | None = None
    wind: str | None = None
    speed_mps: float | None = None
    day: str | None = None


@dataclass(frozen=True)
class FlightFile:
    """A log and its condition."""

    path: Path
    condition: Condition


def read_manifest(path: Path) -> dict[str, Condition]:
    """File name -> condition, in the manifest's order.

    Columns used: file (needed), use, fold, height, angle_deg, wind, speed_mps, day; others
    are ignored, empty cells are None. Raises AirTouchError with file, line and remedy.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as handle:
            reader = csv.DictReader(handle)
            if "file" not in (reader.fieldnames or ()):
                raise AirTouchError(f"{path}:1: no column 'file' in the header; "
                                    "the first line must name the columns")
            conditions: dict[str, Condition] = {}
            for row in reader:
                place = f"{path}:{reader.line_num}"
                name = (row["file"] or "").strip()
                if not name:
                    raise AirTouchError(f"{place}: empty file name")
                if name in conditions:
                    raise AirTouchError(f"{place}: {name} is listed twice")
                conditions[name] = _condition(row, place)
            return conditions
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise AirTouchError(f"{path}: cannot be read as a manifest: {error}") from None


def collect(paths: Iterable[str | Path], speed_mps: float | None = None) -> list[FlightFile]:
    """Every flight named by files and folders, each once, with its condition.

    A folder with a manifest gives the flights whose use is clean (or that say no use), without
    one every log in it. `speed_mps` fills in where the manifest says none. Raises AirTouchError for
    what does not exist and for a folder without flights.
    """
    manifests: dict[Path, dict[str, Condition]] = {}
    members: dict[Path, FlightFile] = {}
    for path in map(Path, paths):
        if not path.exists():
            raise AirTouchError(f"{path}: no such file or folder")
        is_folder = path.is_dir() and not is_bag(path)  # a bag is one flight
        folder = path if is_folder else path.parent
        if folder not in manifests:
            manifest = folder / MANIFEST
            manifests[folder] = read_manifest(manifest) if manifest.is_file() else {}
        listed = manifests[folder]
        condition_of = {folder / name: condition for name, condition in listed.items()}
        files = _flights_of(path, listed) if is_folder else [path]
        for file in files:
            condition = condition_of.get(file, Condition())
            if condition.day is None:
                condition = replace(condition, day=day_of(file))
            if condition.speed_mps is None and speed_mps is not None:
                condition = replace(condition, speed_mps=speed_mps)
            members.setdefault(file.resolve(), FlightFile(file, condition))
    return list(members.values())


def with_flown_speed(file: FlightFile, log: FlightLog) -> FlightFile:
    """The flight with the speed in its log's metadata, where its condition holds none.

    `collect` and `simulate` write it as `speed_mps`, and `speed` of the `condition`.
    """
    if file.condition.speed_mps is not None:
        return file
    drawn = log.meta.get("condition")
    for speed in (log.meta.get("speed_mps"), drawn.get("speed") if isinstance(drawn, Mapping) else None):
        if isinstance(speed, (int, float)) and 0 < speed < MOST_MPS:
            return replace(file, condition=replace(file.condition, speed_mps=float(speed)))
    return file


def not_taken(paths: Iterable[str | Path]) -> Counter[str]:
    """Reason -> number of the flights in folders that `collect` does not take because of the folder's manifest."""
    reasons: Counter[str] = Counter()
    for folder in {p.resolve(): p for p in map(Path, paths) if (p / MANIFEST).is_file()}.values():
        listed = {folder / name: condition for name, condition in read_manifest(folder / MANIFEST).items()}
        reasons.update(f"{c.use} in the manifest" for c in listed.values() if c.use not in (None, "clean"))
        reasons["not in the manifest"] += sum(f not in listed for f in in_folder(folder))
    return +reasons


def day_of(path: Path) -> str | None:
    """The day in a file's name, four digits before four of the time (`imu_data_0126-1906`), or None."""
    match = re.search(r"(\d{4})-\d{4}", path.name)
    return match.group(1) if match else None


def _flights_of(folder: Path, listed: dict[str, Condition]) -> list[Path]:
    """The clean flights of a folder's manifest, or all logs in it without one. Raises AirTouchError without any."""
    if not listed:
        return flights_in(folder)
    files = [folder / name for name, condition in listed.items() if condition.use in (None, "clean")]
    if not files:
        uses = Counter(str(condition.use) for condition in listed.values())
        raise AirTouchError(f"{folder}: no clean flight in its manifest, but "
                            f"{', '.join(f'{count} {use}' for use, count in uses.items())}; name the logs themselves "
                            "to take them")
    return files


def _condition(row: dict[str, str | None], place: str) -> Condition:
    """The condition in a manifest's row. Raises AirTouchError, naming place and column, for a wrong number."""
    def text(name: str) -> str | None:
        return (row.get(name) or "").strip() or None

    def number(name: str) -> float | None:
        value = text(name)
        try:
            result = None if value is None else float(value)
        except ValueError:
            raise AirTouchError(f"{place}: {name} is {value!r}, a number is needed") from None
        if result is not None and not math.isfinite(result):
            raise AirTouchError(f"{place}: {name} is {value!r}, a finite number is needed")
        return result

    def whole(name: str) -> int | None:
        value = number(name)  # pandas writes a column with empty cells as 0.0, 1.0, ...
        if value is not None and not value.is_integer():
            raise AirTouchError(f"{place}: {name} is {text(name)!r}, a whole number is needed")
        return None if value is None else int(value)

    speed = number("speed_mps")
    if speed is not None and not 0 < speed < MOST_MPS:
        raise AirTouchError(f"{place}: speed_mps is {speed:g}, it must be above 0 and below 100")
    return Condition(text("use"), whole("fold"), text("height"), number("angle_deg"), text("wind"),
                     speed, text("day"))
