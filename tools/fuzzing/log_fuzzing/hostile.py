"""Files made to cost time or memory, as long as is wanted: what took too much once, and what might."""

import gzip
import io
import struct
from collections.abc import Callable

import numpy as np

from .sound import motion, pack_log, si_columns


def table(columns: dict[str, np.ndarray], comments: str = "") -> bytes:
    """A canonical CSV; NaN is written as an empty cell."""
    rows = np.column_stack(list(columns.values())).tolist()
    lines = [",".join("" if v != v else repr(v) for v in row) for row in rows]
    return (comments + ",".join(columns) + "\n" + "\n".join(lines) + "\n").encode()


def _flying(n: int, **changed: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of a flight of n samples, some of them replaced."""
    return {**si_columns(motion(n, 0.01, 0)), **changed}


def usd(times: np.ndarray, version: int = 2) -> bytes:
    """A uSD log of three accelerations at the given times (microseconds, or milliseconds in version 1)."""
    variables = [(f"acc.{a}", "f") for a in "xyz"]
    return pack_log(version, [(1, "fixedFrequency", variables)], [(1, int(t), [0.0, 0.1, 1.0]) for t in times])


def damaged_time(n: int) -> bytes:
    """One time of many, a second before the end, with a bit flipped."""
    times = 1000 * np.arange(n)
    times[n // 2] ^= 1 << 36
    return usd(times)


def last_time(n: int) -> bytes:
    """The last time far behind the others."""
    times = 1000 * np.arange(n)
    times[-1] += 10**10
    return usd(times)


def tiny_steps(n: int) -> bytes:
    """Steps of a nanosecond, towards the end of 90 ms."""
    steps = np.where(np.arange(n) > 0.9 * n, 0.09, 1e-9)
    return table(_flying(n, t_s=np.cumsum(steps)))


def fast_and_slow(n: int) -> bytes:
    """Steps of 0.2 ms, towards the end of 90 ms."""
    return table(_flying(n, t_s=np.cumsum(np.where(np.arange(n) > 0.9 * n, 0.09, 2e-4))))


def random_times(n: int) -> bytes:
    """Times in no order."""
    return usd(np.random.default_rng(0).permutation(n) * 1000)


def backwards(n: int) -> bytes:
    """A clock that runs backwards."""
    return usd(1000 * np.arange(n)[::-1])


def gaps(n: int) -> bytes:
    """Five samples at 1 kHz, a pause of 0.2 s, and so on."""
    return table(_flying(n, t_s=0.001 * np.arange(n) + 0.2 * (np.arange(n) // 5)))


def holes(n: int) -> bytes:
    """Every channel misses other samples."""
    columns = _flying(n)
    for i, name in enumerate(columns):
        if name != "t_s":
            columns[name] = np.where((np.arange(n) + i) % 30 < 15, np.nan, columns[name])
    return table(columns)


def edges(n: int) -> bytes:
    """An edge every 0.3 s."""
    return table(_flying(n, zrange_m=np.where(np.arange(n) % 60 < 30, 0.8, 0.1), m1_pwm=np.full(n, 4e4),
                         m2_pwm=np.full(n, 4e4), m3_pwm=np.full(n, 4e4), m4_pwm=np.full(n, 4e4)))


def hops(n: int) -> bytes:
    """Motors on for 0.7 s, off for 0.7 s."""
    on = np.where(np.arange(n) % 140 < 70, 4e4, 0.0)
    return table(_flying(n, **{f"m{i}_pwm": on for i in range(1, 5)}))


def many_columns(n: int) -> bytes:
    """256 columns."""
    rng = np.random.default_rng(0)
    return table({"t_s": np.arange(n) * 0.01} | {f"c{i}": rng.normal(size=n).round(3) for i in range(255)})


def stated_period(text: str) -> Callable[[int], bytes]:
    """A sampling period in the metadata that cannot be."""
    return lambda n: table(_flying(n), f"# sample_period_s: {text}\n")


def wrong_last_row(n: int) -> bytes:
    """A sound table whose last row has a cell too many."""
    return table(_flying(n)) + b"1," * 30 + b"1\n"


def members(n: int) -> bytes:
    """A log behind n empty gzip members."""
    return gzip.compress(b"", mtime=0) * n + gzip.compress(table(_flying(50)))


def constant_parquet(n: int) -> bytes:
    """Columns of one value, which pack into almost nothing."""
    import pyarrow
    from pyarrow import parquet

    sink = io.BytesIO()
    parquet.write_table(pyarrow.table({"t_s": 0.01 * np.arange(n), "zrange_m": np.ones(n)}), sink)
    return sink.getvalue()


def usd_events(n: int) -> bytes:
    """A header of many events without records."""
    body = b"".join(struct.pack("<H", i) + b"e\0" + struct.pack("<H", 1) + b"v(f)\0" for i in range(n % 65536))
    return b"\xbc" + struct.pack("<HH", 2, n % 65536) + body


#: what is hostile -> the file's bytes from its length in samples, lines or parts
HOSTILE: dict[str, Callable[[int], bytes]] = {
    "damaged time": damaged_time, "last time": last_time, "tiny steps": tiny_steps, "fast and slow": fast_and_slow,
    "random times": random_times, "backwards": backwards, "gaps": gaps, "holes": holes, "edges": edges, "hops": hops,
    "many columns": many_columns, "denormal period": stated_period("5e-324"), "huge period": stated_period("1e308"),
    "short period": stated_period("1e-4"), "wrong last row": wrong_last_row,
    "blank lines": lambda n: b"\n" * n + table(_flying(50)), "comments": lambda n: b"# a: 1\n" * n + table(_flying(50)),
    "carriage returns": lambda n: table(_flying(n)).replace(b"\n", b"\r"), "one line": lambda n: b"1," * n,
    "header": lambda n: b"t_s," + b"c," * n + b"\n", "cell": lambda n: b"t_s,zrange_m\n0," + b"1" * n + b"\n",
    "deep metadata": lambda n: b"# a: " + b"[" * n + b"\nt_s\n1\n", "spaces": lambda n: b" " * n + b"t_s\n1\n",
    "members": members, "constant Parquet": constant_parquet, "uSD events": usd_events,
}
