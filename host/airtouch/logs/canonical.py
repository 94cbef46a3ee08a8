"""The canonical CSV: SI units in the column names, metadata in leading `# key: value` lines."""

import gzip
import json
import math
import re
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import COLUMNS, FlightLog
from airtouch.logs.table import names_of, parse_table, split_header

MOST_COLUMNS = 256  #: those of the schema and any others
_KEY = re.compile(r"[A-Za-z_][\w .-]*")


def read(text: bytes, source: str) -> FlightLog:
    """A FlightLog from the bytes of a canonical CSV (line ends LF).

    Metadata values are JSON, or plain text where they are not. Columns that the
    schema does not know are kept and named in a warning.
    Raises AirTouchError for a repeated name, a missing header and bad rows.
    """
    meta: dict[str, Any] = {}
    comments, header, body, line_number = split_header(text)
    for line in comments:
        key, colon, value = line.decode("utf-8", "replace").lstrip("#").partition(":")
        if colon and _KEY.fullmatch(key.strip()):
            meta[key.strip()] = _value(value.strip())
    names = names_of(header)
    if len(names) > MOST_COLUMNS:
        raise AirTouchError(f"{source}:{line_number}: {len(names)} columns; "
                            f"a flight log has at most {MOST_COLUMNS}")
    if len(set(names)) < len(names) or "" in names:
        raise AirTouchError(f"{source}:{line_number}: a column name is empty or repeated; "
                            "give each its own name")
    stored = meta.get("warnings")
    warnings = [str(w) for w in stored] if isinstance(stored, list) else []
    unknown = [name for name in names if name not in COLUMNS]
    if unknown:
        note = f"columns not in the schema, kept as they are: {', '.join(unknown[:8])}"
        if note not in warnings:
            warnings.append(note)
    rows = parse_table(body, source, len(names), line_number + 1, warnings)
    meta = {"vehicle": "", "condition": "", "acc_frame": "body"} | meta
    meta |= {"source": source, "format": "canonical", "warnings": warnings}
    return FlightLog(dict(zip(names, np.ascontiguousarray(rows.T), strict=True)), meta)


def to_bytes(log: FlightLog, compress: bool = False) -> bytes:
    """The file's bytes; every value is written so that it is read back exactly."""
    lines = [f"# {key}: {json.dumps(value, default=plain)}" for key, value in stored_meta(log).items()]
    names = ordered_names(log)
    lines.append(",".join(names))
    cells = [[_shortest(v) for v in log.columns[name].tolist()] for name in names]
    lines += [",".join(row) for row in zip(*cells, strict=True)]
    data = ("\n".join(lines) + "\n").encode()
    return gzip.compress(data, mtime=0) if compress else data


def ordered_names(log: FlightLog) -> list[str]:
    """Column names as they are written: the schema's order, then any others.

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
    """Metadata that goes into a file: where it came from under `origin` and `origin_format`."""
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


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


def plain(value: Any) -> Any:
    """What JSON lacks, as something that it has."""
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else str(value)
