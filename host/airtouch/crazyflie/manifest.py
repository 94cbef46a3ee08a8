"""The manifest of a folder of flights: one row a file, which `evaluate` and `train` read."""

import csv
import io
from pathlib import Path
from typing import Any

from airtouch import logs
from airtouch.crazyflie import recorder
from airtouch.errors import AirTouchError
from airtouch.logs.edges import true_edges
from airtouch.logs.files import MANIFEST, read_text, write_bytes
from airtouch.logs.flight_log import FlightLog
from airtouch.logs.segments import PLATFORM_STEP_M
from airtouch.vehicle import arm_pwm_of

COLUMNS = ("file", "use", "fold", "height", "angle_deg", "wind", "speed_mps")
FOLDS = 5  #: folds of cross-validation, as in the authors' manifest
CLEAN_LOSS = 0.01  #: largest fraction of lost samples of a "clean" flight; one of the authors' 87 lost any: 0.5 %


def list_flight(file: Path, log: FlightLog, planned: bool) -> str:
    """Add a flight to the manifest of its folder, in place of a row of the same file. Returns its `use` there.

    The manifest's other columns stay, empty in the new row. The mission's values come from the log's metadata.
    """
    path = file.parent / MANIFEST
    use = use_of(log, planned)
    names, rows = read(path)
    names += [name for name in COLUMNS if name not in names]
    rows = [row for row in rows if row.get("file") != file.name]
    rows.append(_row(file.name, use, log))
    text = io.StringIO()
    writer = csv.DictWriter(text, names, extrasaction="ignore", restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_bytes(text.getvalue().encode(), path, force=True)
    return use


def use_of(log: FlightLog, planned: bool) -> str:
    """What a flight can be used for.

    "clean": ended as planned, with few lost samples, and crossed an edge. "free-air": the same without an edge, of a
    low platform neither. "messy": any other.
    """
    lost = log.meta["lost_samples"]
    if not planned or lost > CLEAN_LOSS * (len(log) + lost):
        return "messy"
    if crossed_an_edge(log):
        return "clean"
    return "messy" if over_low_platforms_only(log) else "free-air"


def crossed_an_edge(log: FlightLog) -> bool:
    """True if the down range shows an edge, or if there is no down range."""
    return not log.has("zrange_m") or bool(true_edges(log, arm_pwm=arm_pwm_of(log.meta)))


def over_low_platforms_only(log: FlightLog) -> bool:
    """True if the down range steps by more than PLATFORM_STEP_M, but nowhere by as much as at a true edge.

    Scores have no true edges of such a flight, and over the platform it is not in free air.
    """
    return not crossed_an_edge(log) and bool(true_edges(log, PLATFORM_STEP_M, arm_pwm_of(log.meta)))


def recover(folder: Path) -> tuple[list[Path], list[str]]:
    """As `recorder.recover`, and add each recovered flight to the manifest."""
    recovered, unreadable = recorder.recover(folder)
    for path in recovered:
        list_flight(path, logs.read(path), planned=False)
    return recovered, unreadable


def read(path: Path) -> tuple[list[str], list[dict[str, Any]]]:
    """Names of the columns, and rows, of a manifest; none of both without one.

    Raises AirTouchError for one that is no text in UTF-8 or has a row with more cells than columns.
    """
    if not path.is_file():
        return [], []
    reader = csv.DictReader(io.StringIO(read_text(path).removeprefix("\ufeff"), newline=""))
    rows = []
    for row in reader:
        if None in row:
            raise AirTouchError(f"{path}:{reader.line_num}: more cells than columns; put a cell that has a comma in "
                                "quotes")
        rows.append(row)
    return list(reader.fieldnames or []), rows


def _row(name: str, use: str, log: FlightLog) -> dict[str, Any]:
    meta, condition = log.meta, log.meta.get("condition")
    condition = condition if isinstance(condition, dict) else {}
    clearance = condition.get("clearance")
    return {"file": name, "use": use, "fold": int(meta.get("flight") or 0) % FOLDS,
            "height": f"{1000 * clearance:.0f}mm" if clearance is not None else "",
            "angle_deg": condition.get("angle", ""), "wind": condition.get("wind", "none"),
            "speed_mps": meta.get("speed_mps") or ""}
