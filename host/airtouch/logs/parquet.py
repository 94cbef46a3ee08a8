"""Flight logs as Parquet, metadata as JSON under the key `airtouch`."""

import io
import json
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.canonical import MOST_COLUMNS, ordered_names, plain, stored_meta
from airtouch.logs.flight_log import COLUMNS, FlightLog

_KEY = b"airtouch"


def read(data: bytes, source: str) -> FlightLog:
    """A FlightLog from the bytes of a Parquet file.

    Raises AirTouchError for a damaged file, one without a known column, and columns
    that are not numbers.
    """
    arrow, parquet = _pyarrow(source)
    try:
        table = parquet.read_table(io.BytesIO(data))
        if table.num_columns > MOST_COLUMNS:
            raise ValueError(f"{table.num_columns} columns; a flight log has at most {MOST_COLUMNS}")
        columns = {name: _numbers(table.column(name)) for name in table.column_names}
        meta = json.loads((table.schema.metadata or {}).get(_KEY, b"{}"))
    except (arrow.ArrowException, OSError, ValueError, TypeError, MemoryError, RecursionError) as error:
        first = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise AirTouchError(f"{source}: damaged or unsuitable Parquet file: {first[:120]}") from None
    if not any(name in COLUMNS for name in columns) or not table.num_rows:
        raise AirTouchError(f"{source}: no known column or no row in this Parquet file; "
                            "see the table of columns")
    meta = meta if isinstance(meta, dict) else {}
    stored = meta.get("warnings")
    meta["warnings"] = [str(w) for w in stored] if isinstance(stored, list) else []
    return FlightLog(columns, {"vehicle": "", "condition": "", "acc_frame": "body"} | meta
                     | {"source": source, "format": "parquet"})


def to_bytes(log: FlightLog) -> bytes:
    """The file's bytes; values and metadata are read back exactly."""
    arrow, parquet = _pyarrow(log.source)
    table = arrow.table({name: log.columns[name] for name in ordered_names(log)})
    stored = json.dumps(stored_meta(log), default=plain).encode()
    sink = io.BytesIO()
    parquet.write_table(table.replace_schema_metadata({_KEY: stored}), sink, compression="zstd")
    return sink.getvalue()


def _numbers(column: Any) -> np.ndarray:
    return np.asarray(column.to_numpy(), dtype=np.float64)


def _pyarrow(source: str) -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise AirTouchError(f"{source}: Parquet needs pyarrow; pip install airtouch[parquet]") from None
    return pyarrow, pyarrow.parquet
