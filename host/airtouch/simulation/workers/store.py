"""A folder of simulated flights: what was asked for, what is there, what went wrong.

`run.json` holds the request, with the version of AirTouch and the firmware's settings; a second run with another
request is refused, and so is one over flights of which run.json does not say these. A flight is
written under a temporary name and renamed, so a file that is there is whole, and after a
kill the same command flies only what is missing. Flights that diverged are listed in
`diverged.jsonl` and have no file.
"""

import csv
import hashlib
import io
import json
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from airtouch import __version__, logs
from airtouch.errors import AirTouchError
from airtouch.logs import json_lines
from airtouch.logs.files import FAILED, MANIFEST, REQUEST, load_bytes, make_folder, read_text
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.firmware import settings
from airtouch.simulation.flight import Chosen, Diverged
from airtouch.simulation.scenario import Scenario, draw_flight
from airtouch.tables import is_number
from airtouch.vehicle import Vehicle

HEAD = "file,use,fold,height,angle_deg,wind,speed_mps"  #: first line of the manifest
NUMBER = re.compile(r"(\d{6,})\.csv\.gz")  #: end of a flight's file name
FLIGHT = re.compile(r".+_\d+_" + NUMBER.pattern)  #: a flight's file name


def request_of(scenario: Scenario, vehicle: Vehicle, effects: Chosen, without: Sequence[str], seed: int,
               plugins: Sequence[str] = ()) -> dict[str, Any]:
    """What the flights of a batch depend on, beside their numbers, JSON-ready. plugins: texts of effect files."""
    release = settings.load(draw_flight(scenario, seed, 0).with_changes(vehicle).firmware)
    return {"airtouch": __version__, "firmware_digest": digest(repr(release.tolist())),
            "scenario": scenario.name, "scenario_digest": digest(repr(scenario.table)),
            "vehicle": vars(vehicle), "effects": effects, "without": list(without), "seed": seed,
            "effect_files": [digest(text) for text in plugins]}


def open_folder(folder: Path, request: Mapping[str, Any], force: bool = False) -> None:
    """Make the folder, or continue one of the same request.

    With `force` the flights of another request are removed, by the names that its run.json gives them. Raises
    AirTouchError when it holds flights of another request and `force` is not given; and, whatever `force`, when it
    holds flights or a manifest.csv that were written by something else.
    """
    text = json.dumps(request, indent=1, sort_keys=True)
    make_folder(folder)
    check_manifest(folder)
    known = folder / REQUEST
    if known.is_file() and known.read_bytes() == text.encode():  # bytes, as a damaged one may be no text
        return
    if known.is_file():
        old, own = _of_request(folder, known)
        if not force:
            other = sorted(key for key in {*request, *old} if _as_text(request, key) != _as_text(old, key))
            raise AirTouchError(f"{folder}: holds flights of another request (other or not known: "
                                f"{', '.join(other) or 'its form'}); choose another --out, or --force")
        for path in own:
            path.unlink(missing_ok=True)
    elif [*folder.glob("*.csv.gz"), *folder.glob("*.jsonl")]:
        raise AirTouchError(f"{folder}: holds flights but no {REQUEST} of a simulation; choose another --out")
    temporary = folder / f".{REQUEST}.{os.getpid()}"
    temporary.write_text(text)
    temporary.replace(known)


def _as_text(request: Mapping[str, Any], key: str) -> str | None:
    """The value of a key as run.json holds it; None where there is none."""
    return json.dumps(request[key], sort_keys=True) if key in request else None


def _of_request(folder: Path, known: Path) -> tuple[dict[str, Any], list[Path]]:
    """The request in a folder's run.json, and what it wrote beside it.

    Raises AirTouchError for a file that is no request.
    """
    try:
        request = json.loads(known.read_text(encoding="utf-8"))
        scenario, seed = str(request["scenario"]), int(request["seed"])
    except (ValueError, KeyError, TypeError):
        raise AirTouchError(f"{known}: not the request of a simulation; choose another --out") from None
    return request, [*_flights(folder, scenario, seed).values(), folder / FAILED, folder / MANIFEST]


def check_manifest(folder: Path) -> None:
    """Raise AirTouchError where the folder's manifest.csv is not one of `write_manifest`."""
    path = folder / MANIFEST
    if not path.exists():
        return
    head, *rows = load_bytes(path).decode(errors="replace").splitlines() or [""]
    if head != HEAD or not all(FLIGHT.fullmatch(_file_of(row)) for row in rows):
        raise AirTouchError(f"{path}: not written by a simulation, and its flights need another; "
                            "choose another folder, or move it away")


def _file_of(row: str) -> str:
    """The first cell of a row of a manifest; "" where there is none."""
    try:
        return next(csv.reader([row]), [""])[0]
    except csv.Error:
        return ""


def path_of(folder: Path, scenario: str, seed: int, flight: int) -> Path:
    """File of one flight."""
    return folder / f"{Path(scenario).name}_{seed}_{flight:06d}.csv.gz"


def _flights(folder: Path, scenario: str, seed: int) -> dict[int, Path]:
    """Flight number -> file, of the flights of a scenario and seed that are in the folder."""
    begin = f"{Path(scenario).name}_{seed}_"
    files = {int(match[1]): p for p in folder.glob("*.csv.gz")
             if p.name.startswith(begin) and (match := NUMBER.fullmatch(p.name[len(begin):]))}
    return dict(sorted(files.items()))


def missing(folder: Path, scenario: str, seed: int, count: int) -> list[int]:
    """Numbers of the flights that are neither written nor known to diverge."""
    done = {p.name for p in folder.glob("*.csv.gz")}
    gone = {d["flight"] for d in failures(folder)}
    return [n for n in range(count) if n not in gone and path_of(folder, scenario, seed, n).name not in done]


def failures(folder: Path) -> list[dict[str, Any]]:
    """Flights that diverged, by number; a line that is no record, as one cut short by a kill, is skipped.

    Raises AirTouchError for a file that is no text.
    """
    path = folder / FAILED
    entries = {}
    for line in read_text(path).splitlines() if path.is_file() else []:
        try:
            entry = vars(Diverged(**json.loads(line)))
        except (ValueError, TypeError):
            continue
        if isinstance(entry["flight"], int) and is_number(entry["time_s"]):
            entries[entry["flight"]] = entry
    return [entries[n] for n in sorted(entries)]


def save(folder: Path, scenario: str, result: FlightLog | Diverged) -> Path | None:
    """Write a flight, or note one that diverged. An existing flight is kept."""
    if isinstance(result, Diverged):
        json_lines.append(folder / FAILED, [vars(result)])
        return None
    path = path_of(folder, scenario, result.meta["seed"], result.meta["flight"])
    if not path.exists():
        logs.write(result, path, force=True)
    return path


def write_manifest(folder: Path, scenario: Scenario, seed: int) -> None:
    """`manifest.csv` beside the flights of a scenario and seed, as `evaluate` and `crossval` read it.

    Rows that it has stay as they are, edited or not, if their flight is there; those of new flights are appended.
    speed_mps, height, angle_deg and wind are the scenario's values speed, clearance, angle and wind; folds go round by
    flight number. Raises AirTouchError for a manifest of something else.
    """
    check_manifest(folder)
    path = folder / MANIFEST
    listed = {_file_of(row): row for row in read_text(path).splitlines()[1:]} if path.exists() else {}
    lines = [HEAD, *(row for name, row in listed.items() if (folder / name).exists())]
    for number, flight in _flights(folder, scenario.name, seed).items():
        if flight.name in listed:
            continue
        values = draw_flight(scenario, seed, number).values
        height = f"{1000 * values['clearance']:.0f}mm" if is_number(values.get("clearance")) else ""
        cells = [flight.name, "clean", number % 5, height, values.get("angle", ""), values.get("wind", "none"),
                 values.get("speed", "")]
        text = io.StringIO()
        csv.writer(text, lineterminator="").writerow([f"{c:.4g}" if isinstance(c, float) else c for c in cells])
        lines.append(text.getvalue())
    temporary = folder / f".{MANIFEST}.{os.getpid()}"
    temporary.write_text("\n".join(lines) + "\n")
    temporary.replace(folder / MANIFEST)


def digest(text: str) -> str:
    """Short hash of a request's text."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]
