"""The canonical CSV: SI units in the column names, metadata in leading `# key: value` lines."""

import gzip
import json
import math
import re
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError, printable
from airtouch.logs.flight_log import COLUMNS, FlightLog
from airtouch.logs.table import Sheet, named_table

DEEPEST = 50  #: levels of nesting that a metadata value may have; Python's JSON parser recurses and fails at about 1000
LONGEST_WARNING = 400  #: characters; a stored warning is cut to it, so that a damaged file cannot fill the screen
#: of gzip, the default of its command: level 9 takes much longer for hardly smaller logs
LEVEL = 6
_KEY = re.compile(r"[A-Za-z_][\w .-]*")


def read(text: Sheet, source: str) -> FlightLog:
    """The FlightLog of a canonical CSV.

    Metadata values are JSON, or plain text where they are not. Columns that the
    schema does not know are kept and named in a warning.
    Raises AirTouchError for a repeated name, a missing header and bad rows.
    """
    meta: dict[str, Any] = {}
    for line in text.comments:
        key, colon, value = line.decode("utf-8", "replace").lstrip("#").partition(":")
        if colon and _KEY.fullmatch(key.strip()):
            meta[key.strip()] = json_value(value.strip())
    warnings = stored_warnings(meta)
    columns = named_table(text, source, warnings)
    unknown = [printable(name) for name in columns if name not in COLUMNS]
    if unknown:
        note = f"columns not in the schema, kept as they are: {', '.join(unknown[:8])}"
        if note not in warnings:
            warnings.append(note)
    meta = {"vehicle": "", "condition": "", "acc_frame": "body"} | meta
    return FlightLog(columns, meta | {"source": source, "format": "canonical", "warnings": warnings})


def to_bytes(log: FlightLog, compress: bool = False) -> bytes:
    """The bytes of a canonical CSV. Every value is read back exactly as it was."""
    lines = [f"# {key}: {json.dumps(value, default=plain)}" for key, value in stored_meta(log).items()]
    names = ordered_names(log)
    lines.append(",".join(names))
    cells = [[_shortest(v) for v in log.columns[name].tolist()] for name in names]
    lines += [",".join(row) for row in zip(*cells, strict=True)]
    data = ("\n".join(lines) + "\n").encode()
    return gzip.compress(data, LEVEL, mtime=0) if compress else data


def plain_csv(log: FlightLog) -> bytes:
    """The bytes of a CSV without metadata, empty cells for NaN: for PlotJuggler, spreadsheets and other programs."""
    names = ordered_names(log)
    cells = [[_shortest(v) if v == v else "" for v in log.columns[name].tolist()] for name in names]
    return ("\n".join([",".join(names), *(",".join(row) for row in zip(*cells, strict=True))]) + "\n").encode()


def ordered_names(log: FlightLog) -> list[str]:
    """The column names in the order in which they are written: the schema's, then the others by alphabet.

    Raises AirTouchError for a log without columns and for a name that a CSV cannot hold.
    """
    if not log.columns:
        raise AirTouchError(f"{log.source}: a log without columns cannot be written")
    others = sorted(set(log.columns) - set(COLUMNS))
    for name in others:
        if not name or name != name.strip() or any(c in name for c in ",\n\r#\ufeff"):
            raise AirTouchError(f"{log.source}: column name {name!r} cannot be written; rename it")
    return [name for name in COLUMNS if name in log.columns] + others


def stored_meta(log: FlightLog) -> dict[str, Any]:
    """The metadata to write into a file. `source` and `format` become `origin` and `origin_format`.

    Raises AirTouchError for a key that is not made of letters, digits and _.
    """
    meta = {k: v for k, v in log.meta.items() if k not in ("source", "format")}
    for key, name in (("source", "origin"), ("format", "origin_format")):
        if key in log.meta:
            meta.setdefault(name, log.meta[key])
    for key in meta:
        if not _KEY.fullmatch(str(key)) or str(key) != str(key).strip():
            raise AirTouchError(f"{log.source}: metadata key {key!r} cannot be written; "
                                "use letters, digits and _")
    return meta


def _shortest(value: float) -> str:
    if value.is_integer() and abs(value) < 1e15:
        return "-0" if value == 0 and math.copysign(1, value) < 0 else str(int(value))
    return repr(value)


def json_value(text: str) -> Any:
    """The value of a JSON text. Text that is not JSON, or is nested more than 50 deep, is returned as it is."""
    depth = np.cumsum([(c in "[{") - (c in "]}") for c in text]) if text.count("[") + text.count("{") > DEEPEST else [0]
    try:
        return json.loads(text) if max(depth) <= DEEPEST else text
    except ValueError:
        return text


def stored_warnings(meta: dict[str, Any]) -> list[str]:
    """The warnings that were stored with a log, each printable and at most 400 characters long."""
    stored = meta.get("warnings")
    return [printable(str(w), LONGEST_WARNING) for w in stored] if isinstance(stored, list) else []


def plain(value: Any) -> Any:
    """A NumPy array or number as a Python list or number; anything else as text. For `json.dumps(default=...)`."""
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else str(value)
