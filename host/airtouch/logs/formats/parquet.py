"""Flight logs as Parquet, metadata as JSON under the key `airtouch`."""

import io
import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError, printable
from airtouch.logs.flight_log import COLUMNS, LARGEST_BYTES, FlightLog
from airtouch.logs.formats.canonical import json_value, ordered_names, plain, stored_meta, stored_warnings
from airtouch.logs.table import check_names

_KEY = b"airtouch"
LARGEST_STRING, MOST_IN_LIST = 16 << 20, 1 << 20  #: bytes and items that a footer may have; 256 columns need far less


def read(data: bytes, source: str) -> FlightLog:
    """The FlightLog in the bytes of a Parquet file. Nulls become NaN.

    The sizes in its footer are checked before anything is unpacked. Raises AirTouchError
    for a damaged file, one without a known column, and columns that are not numbers.
    """
    arrow, parquet = _pyarrow(source)
    with _damage(arrow, source):
        file = parquet.ParquetFile(io.BytesIO(data), thrift_string_size_limit=LARGEST_STRING,
                                   thrift_container_size_limit=MOST_IN_LIST)
        schema = file.schema_arrow
        meta = json_value((schema.metadata or {}).get(_KEY, b"{}").decode())
    _check(schema, file.metadata, arrow.types, source)
    with _damage(arrow, source):
        table = file.read(use_threads=False)
        columns = {name: _numbers(table.column(name), arrow) for name in schema.names}
    meta = meta if isinstance(meta, dict) else {}
    return FlightLog(columns, {"vehicle": "", "condition": "", "acc_frame": "body"} | meta
                     | {"source": source, "format": "parquet", "warnings": stored_warnings(meta)})


def to_bytes(log: FlightLog) -> bytes:
    """The bytes of a Parquet file. Values and metadata are read back exactly as they were."""
    arrow, parquet = _pyarrow(log.source)
    table = arrow.table({name: log.columns[name] for name in ordered_names(log)})
    stored = json.dumps(stored_meta(log), default=plain).encode()
    sink = io.BytesIO()
    parquet.write_table(table.replace_schema_metadata({_KEY: stored}), sink, compression="zstd")
    return sink.getvalue()


@contextmanager
def _damage(arrow: Any, source: str) -> Iterator[None]:
    """Turn pyarrow's exceptions into an AirTouchError."""
    try:
        yield
    except (arrow.ArrowException, OSError, ValueError, TypeError, MemoryError) as error:
        reason = printable(str(error).partition("\n")[0] or type(error).__name__, 120)
        raise AirTouchError(f"{source}: damaged Parquet file ({reason}); copy or write it again") from None


def _check(schema: Any, footer: Any, types: Any, source: str) -> None:
    """Raise AirTouchError for too many rows or columns, and for columns with bad names, unknown names or no numbers."""
    check_names(schema.names, source)
    for field in schema:
        if not any(check(field.type) for check in (types.is_integer, types.is_floating, types.is_boolean,
                                                   types.is_decimal, types.is_null)):
            raise AirTouchError(f"{source}: column '{printable(field.name)}' holds {printable(str(field.type))}, not "
                                "numbers; leave it out")
    if not set(schema.names) & set(COLUMNS) or not footer.num_rows:
        raise AirTouchError(f"{source}: no known column or no row in this Parquet file; "
                            "name the columns as in the table of columns")
    if footer.num_rows * len(schema.names) * 8 > LARGEST_BYTES:
        raise AirTouchError(f"{source}: {footer.num_rows} rows of {len(schema.names)} columns are more than 1 GiB; "
                            "split the log")


def _numbers(column: Any, arrow: Any) -> np.ndarray:
    """A column (n,) of float64."""
    return np.array((column.cast(arrow.float64()) if arrow.types.is_decimal(column.type) else column).to_numpy(),
                    dtype=np.float64)


def _pyarrow(source: str) -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise AirTouchError(f"{source}: Parquet needs pyarrow; pip install airtouch[parquet]") from None
    return pyarrow, pyarrow.parquet
