"""Mutations of Parquet files: of their columns, types, nulls and metadata, then of their bytes."""

import datetime
import decimal
import io
import struct
from collections.abc import Callable
from random import Random

import pyarrow as pa
from pyarrow import parquet

from .mutations import META, any_bytes, cut, zip_again

#: numbers that a cell may come to hold
EXTREMES = (float("nan"), float("inf"), -float("inf"), 1e308, -1e308, 5e-324, 4e38, -0.0, 1e19, 1e10, 1e12, 65536.0)
#: metadata
JSON = (
    *(b'{"%s": %s}' % tuple(line[2:].split(b": ", 1)) for line in META if b": " in line),
    b"[" * 5000, b'{"sample_period_s": 1e-300}', b'{"sample_period_s": 1e400}', b"\xff", b"9" * 5000, b"[]", b"1", b"",
    b'{"warnings": ["a\\nb", "\\ud800"]}', b'{"acc_frame": 5, "vehicle": [], "condition": NaN}', b'{"source": 1}')
#: names of columns
NAMES = ("t_s", "acc_x_mps2", "m1_pwm", "zrange_m", "", " ", "a\nb", "\x1b[31m", "\u00e9", "n" * 3000, "a,b",
         "__index_level_0__")
#: types of columns
NUMBERS = (pa.int8(), pa.uint8(), pa.int16(), pa.int32(), pa.uint32(), pa.int64(), pa.uint64(), pa.float32())
MOST_GROUPS = 10  #: of rows in a file: writing them takes longer than reading
#: type of a column of pairs, which no log has
PAIR = pa.list_(pa.float64(), 2)


def _odd(values: list, r: Random) -> pa.Array:
    """The same number of values in an unusual type."""
    n = len(values)
    whole = [int(v) % 100 if v == v and abs(v) < 1e15 else 0 for v in values]
    text = [str(v) for v in values]
    kinds: tuple[Callable[[], pa.Array], ...] = (
        lambda: pa.array(whole, r.choice(NUMBERS)), lambda: pa.array([float(v) for v in whole]).cast(pa.float16()),
        lambda: pa.array([2**63 + v for v in whole], pa.uint64()), lambda: pa.array([-(2**63)] * n, pa.int64()),
        lambda: pa.array([bool(v) for v in whole]), lambda: pa.array([decimal.Decimal(v) for v in whole]),
        lambda: pa.nulls(n), lambda: pa.nulls(n, pa.float64()),
        lambda: pa.array(text), lambda: pa.array(text, pa.large_string()), lambda: pa.array(text).dictionary_encode(),
        lambda: pa.array(["x" * r.choice((1, 3000))] * n), lambda: pa.array([b"\xff"] * n),
        lambda: pa.array([b"12345678"] * n, pa.binary(8)), lambda: pa.array(values).dictionary_encode(),
        lambda: pa.array([[v] for v in values]), lambda: pa.array([[v] * (i % 3) for i, v in enumerate(values)]),
        lambda: pa.array([[[v]] for v in values]), lambda: pa.array([[v, v] for v in values], PAIR),
        lambda: pa.array([{"a": v, "b": [v]} for v in values]),
        lambda: pa.array([[("k", v)] for v in values], pa.map_(pa.string(), pa.float64())),
        lambda: pa.array([datetime.datetime(2026, 1, 1)] * n), lambda: pa.array(whole, pa.duration("ms")),
        lambda: pa.array(whole, pa.timestamp("ns", "UTC")), lambda: pa.array(whole, pa.date32()),
        lambda: pa.array(whole, pa.time64("us")))
    return r.choice(kinds)()


def _column(values: list, r: Random) -> pa.Array:
    """A column with nulls or extremes, or of another type."""
    kind = r.randrange(4)
    if kind == 0:
        return _odd(values, r)
    start = r.randrange(len(values) + 1)
    stop = r.choice((start + 1, start + 5, len(values)))
    value = None if kind == 1 else r.choice(EXTREMES)
    return pa.array([value if start <= i < stop else v for i, v in enumerate(values)], pa.float64())


def _write(names: list[str], arrays: list[pa.Array], meta: bytes | None, r: Random) -> bytes:
    """A Parquet file of these columns, with random settings of the writer."""
    table = pa.Table.from_arrays(arrays, names=names)
    if meta is not None:
        table = table.replace_schema_metadata({b"airtouch": meta})
    sink = io.BytesIO()
    parquet.write_table(table, sink, compression=r.choice(("none", "snappy", "zstd", "gzip")),
                        use_dictionary=r.random() < 0.5,
                        row_group_size=max(r.choice((1, 7, 1000)), table.num_rows // MOST_GROUPS, 1),
                        data_page_version=r.choice(("1.0", "2.0")), write_page_checksum=r.random() < 0.3,
                        store_schema=r.random() < 0.7)
    return sink.getvalue()


def _table(data: bytes, r: Random) -> bytes:
    """The file written anew with other columns, types, nulls, names, lengths or metadata."""
    table = parquet.read_table(io.BytesIO(data))
    names, arrays = list(table.column_names), [column.combine_chunks() for column in table.columns]
    meta = table.schema.metadata[b"airtouch"]
    for _ in range(r.choice((1, 1, 2, 3))):
        place, kind = r.randrange(len(names)), r.randrange(10)
        if kind < 5:
            column = arrays[place].to_pylist()
            if all(isinstance(v, float) for v in column):
                arrays[place] = _column(column, r)
        elif kind == 5:
            names[place] = r.choice((*NAMES, *names))
        elif kind == 6 and len(names) > 1:
            del names[place], arrays[place]
        elif kind == 7:
            times = r.choice((1, 1, 1, 1, 1, 1, 1, 1, 1, 300))
            names += [f"c{i}" for i in range(times)]
            arrays += [arrays[place]] * times
        elif kind == 8:
            rows = r.choice((0, 1, 2))
            arrays = [array[:rows] for array in arrays]
        else:
            meta = r.choice((*JSON, None))
    return _write(names, arrays, meta, r)


def _footer(data: bytes, r: Random) -> bytes:
    """The footer's bytes or its stated length damaged."""
    size = struct.unpack("<I", data[-8:-4])[0]
    footer = data[-8 - size:-8]
    if r.random() < 0.2:
        size = r.choice((0, 1, size - 1, size + 1, 2**31 - 1, 2**31, 2**32 - 1))
        return data[:-8] + struct.pack("<I", size) + data[-4:]
    damaged = bytearray(footer)
    for _ in range(r.choice((1, 1, 2, 5))):
        place = r.randrange(len(damaged))
        if r.random() < 0.5:
            damaged[place] ^= 1 << r.randrange(8)
        else:  # a giant varint
            damaged[place:place + 5] = b"\xff\xff\xff\xff\x0f"[:len(damaged) - place]
    return data[:-8 - size] + bytes(damaged) + struct.pack("<I", len(damaged)) + data[-4:]


def parquet_file(data: bytes, r: Random) -> bytes:
    """A Parquet file with other content, or with damaged bytes."""
    kind = r.random()
    if kind < 0.5:
        data = _table(data, r)
    if 0.45 < kind < 0.75:
        data = _footer(data, r) if len(data) > 12 else data
    elif kind > 0.75:
        data = b"PAR1" + any_bytes(data[4:], r) if r.random() < 0.8 else cut(data, r)
    return zip_again(data, r) if r.random() < 0.02 else data
