"""Sound log files of every format, written here from the formats' descriptions and not by the package."""

import gzip
import io
import json
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

AUTHORS = (6, 8, 9, 12, 13, 14)  #: columns of the authors' layouts
LEVEL = 3 << 30  #: Bitcraze's compressed quaternion of level attitude


@dataclass(frozen=True)
class Motion:
    """A short flight in a Crazyflie's own units: arrays (n,) and (n, 3) or (n, 4)."""

    time_s: np.ndarray
    acc_g: np.ndarray
    gyro_dps: np.ndarray
    pwm: np.ndarray
    down_mm: np.ndarray
    battery_mv: np.ndarray


def motion(rows: int, period_s: float, seed: int) -> Motion:
    """Take-off, level flight across a platform and landing, in `rows` samples."""
    rng = np.random.default_rng(seed)
    place = np.arange(rows) / max(rows - 1, 1)
    height = np.interp(place, (0.0, 0.1, 0.2, 0.8, 0.9, 1.0), (0, 0, 800, 800, 0, 0))
    height[(place > 0.4) & (place < 0.6)] -= 500
    flying = (place > 0.05) & (place < 0.95)
    return Motion(
        3.0 + period_s * np.arange(rows), rng.normal((0, 0, 1), 0.05, (rows, 3)), rng.normal(0, 20, (rows, 3)),
        np.where(flying[:, None], 40000 + rng.integers(-900, 900, (rows, 4)), 0),
        np.round(np.maximum(height + rng.normal(0, 4, rows), 0)), np.round(3900 - 200 * place))


def _text(names: tuple[str, ...], columns: list[np.ndarray], comments: str = "") -> bytes:
    """A CSV with comments and header, either possibly empty."""
    rows = [",".join(f"{v:.9g}" for v in row) + "\n" for row in np.column_stack(columns)]
    return (comments + (",".join(names) + "\n" if names else "") + "".join(rows)).encode()


def authors(flight: Motion, width: int) -> bytes:
    """A headerless CSV of the paper's authors with 6, 8, 9, 12, 13 or 14 columns."""
    acc, gyro = np.round(flight.acc_g * 9810), np.round(flight.gyro_dps * 16.384)
    clock, down, zero = flight.time_s[:, None], flight.down_mm[:, None], 0 * flight.down_mm[:, None]
    parts = {
        6: [zero, zero, zero, zero + 1, zero + LEVEL, clock],
        8: [flight.acc_g, flight.gyro_dps, clock, down],
        9: [gyro, flight.pwm, clock, down],
        12: [acc, gyro, flight.pwm, clock, down],
        13: [acc, gyro, flight.pwm, zero + LEVEL, clock, down],
        14: [acc, gyro, flight.pwm, zero + 700, zero + 900, clock, down],
    }[width]
    return "".join(",".join(f"{v:.18e}" for v in row) + "\n" for row in np.hstack(parts)).encode()


def _variables(flight: Motion) -> dict[str, np.ndarray]:
    """Crazyflie log variables."""
    zero = 0 * flight.down_mm
    table = {f"acc.{a}": flight.acc_g[:, i] for i, a in enumerate("xyz")}
    table |= {f"gyro.{a}": flight.gyro_dps[:, i] for i, a in enumerate("xyz")}
    table |= {f"motor.m{i + 1}": flight.pwm[:, i] for i in range(4)}
    table |= {f"stateEstimate.a{a}": flight.acc_g[:, i] - (a == "z") for i, a in enumerate("xyz")}
    table |= {f"stateEstimate.v{a}": zero + 0.2 for a in "xy"} | {"stateEstimate.vz": zero}
    table |= {f"stateEstimate.{a}": zero + i for i, a in enumerate("xyz")}
    table |= {f"stateEstimate.{a}": zero + i for i, a in enumerate(("roll", "pitch", "yaw"))}
    table |= {f"stateEstimate.q{a}": zero + (a == "w") for a in "xyzw"}
    return table | {"pm.vbatMV": flight.battery_mv, "range.zrange": flight.down_mm,
                    "stateEstimateZ.quat": zero + LEVEL}


def crazypad(flight: Motion) -> bytes:
    """CrazyPAD's columns: no gyro, no pitch."""
    table = {name: v for name, v in _variables(flight).items()
             if name.split(".")[0] in ("motor", "pm", "stateEstimate") and not name.endswith((".pitch", "qw"))}
    return _text(("timestamp_ms", *table), [1e3 * flight.time_s, *table.values()])


def imrclab(flight: Motion) -> bytes:
    """IMRCLab's columns: pose, rates, accelerations, motors, battery."""
    table = {name: v for name, v in _variables(flight).items() if ".a" not in name}
    return _text(("timestamp_ms", *table), [1e3 * flight.time_s, *table.values()])


def thrust_stand(flight: Motion) -> bytes:
    """A thrust-stand run; no flight."""
    pwm = flight.pwm[:, 0]
    return _text(("weight[g]", "pwm", "vbat[V]", "rpm1", "rpm2", "rpm3", "rpm4", "v[V]", "i[A]", "p[W]"),
                 [pwm / 2000, pwm, flight.battery_mv / 1e3, *[pwm / 3] * 4, pwm / 2e4, pwm / 4e4, pwm / 9e3])


def si_columns(flight: Motion) -> dict[str, np.ndarray]:
    """The schema's columns."""
    table = {"t_s": flight.time_s}
    table |= {f"acc_{a}_mps2": 9.81 * flight.acc_g[:, i] for i, a in enumerate("xyz")}
    table |= {f"gyro_{a}_radps": np.deg2rad(flight.gyro_dps[:, i]) for i, a in enumerate("xyz")}
    table |= {f"m{i + 1}_pwm": flight.pwm[:, i].astype(float) for i in range(4)}
    return table | {"zrange_m": flight.down_mm / 1e3, "vbat_V": flight.battery_mv / 1e3,
                    "vx_mps": 0 * flight.time_s + 0.2, "vy_mps": 0 * flight.time_s, "yaw_rad": flight.time_s % 3,
                    "humidity": flight.time_s}


#: metadata of the sound files
META = {"vehicle": "crazyflie-2.1", "condition": {"height_m": 0.8}, "acc_frame": "body", "warnings": ["windy"],
        "sample_period_s": 0.01}


def canonical(flight: Motion) -> bytes:
    """AirTouch's CSV with its metadata."""
    table = si_columns(flight)
    comments = "".join(f"# {key}: {json.dumps(value)}\n" for key, value in META.items())
    return _text(tuple(table), list(table.values()), comments)


def usd(flight: Motion, version: int) -> bytes:
    """A uSD log of two kinds of events."""
    table = _variables(flight)
    kinds = ["I" if name.endswith("quat") else "H" if name.startswith(("motor", "range", "pm")) else "f"
             for name in table]
    main = [list(row) for row in np.column_stack(list(table.values())).tolist()]
    unit = 1e3 if version == 1 else 1e6
    records = []
    for i, (time_s, row) in enumerate(zip(flight.time_s, main, strict=True)):
        tick = round(time_s * unit)
        records.append((7, tick, [int(v) if k in "HI" else v for v, k in zip(row, kinds, strict=True)]))
        if i % 5 == 0:
            records.append((9, tick, [1.5]))
    events = [(7, "fixedFrequency", list(zip(table, kinds, strict=True))), (9, "estTDOA", [("distance", "f")])]
    return pack_log(version, events, records)


def pack_log(version: int, events: list, records: list) -> bytes:
    """The bytes of a uSD log: events (id, name, [(variable, type)]), records (id, time, values), CRC-32."""
    out = [b"\xbc", struct.pack("<HH", version, len(events))]
    for number, name, variables in events:
        out.append(struct.pack("<H", number) + name.encode() + b"\0" + struct.pack("<H", len(variables)))
        out += [f"{variable}({kind})".encode() + b"\0" for variable, kind in variables]
    layouts = {number: struct.Struct("<HI" if version == 1 else "<HQ") for number, _, _ in events}
    bodies = {number: struct.Struct("<" + "".join(kind for _, kind in variables)) for number, _, variables in events}
    for number, tick, values in records:
        out.append(layouts[number].pack(number, tick) + bodies[number].pack(*values))
    data = b"".join(out)
    return data + struct.pack("<I", zlib.crc32(data))


def usd_old(flight: Motion) -> bytes:
    """A uSD log of firmware before March 2021, with the attitude swinging in pitch and no gyro but the estimator's."""
    swing = 0.3 * np.sin(4.0 * flight.time_s)
    table = {"tick": np.round(1e3 * flight.time_s)}
    table |= {name: v for name, v in _variables(flight).items() if not name.startswith("gyro")}
    table |= {"stateEstimate.qy": np.sin(0.5 * swing), "stateEstimate.qw": np.cos(0.5 * swing)}
    rates = {"Roll": 0.0 * swing, "Pitch": 1.2 * np.cos(4.0 * flight.time_s), "Yaw": 0.0 * swing}
    table |= {f"stateEstimateZ.rate{axis}": np.round(1e3 * rate) for axis, rate in rates.items()}
    kinds = ["I" if name == "tick" or name.endswith("quat") else "h" if ".rate" in name else
             "H" if name.startswith(("motor", "range", "pm")) else "f" for name in table]
    packer = struct.Struct("<" + "".join(kinds))
    rows = [packer.pack(*(v if kind == "f" else int(v) for v, kind in zip(row, kinds, strict=True)))
            for row in np.column_stack(list(table.values())).tolist()]
    return pack_old_log([(name.encode(), kind) for name, kind in zip(table, kinds, strict=True)], rows, 7)


def pack_old_log(variables: list, rows: list[bytes], a_block: int,
               other: Callable[[int, bytes], tuple[int, bytes]] = lambda count, checksum: (count, checksum)) -> bytes:
    """The bytes of an old uSD log: variables (name, type), packed rows, so many a block.

    other: row count and checksum of a block in place of the right ones.
    """
    head = bytes([len(variables) % 256]) + b"".join(b"%s(%s)," % (name, kind.encode()) for name, kind in variables)
    out = [head, _uninverted(head)]
    for k in range(0, len(rows), a_block):
        block = rows[k:k + a_block]
        count, checksum = other(len(block), _uninverted(bytes([len(block)]) + b"".join(block)))
        out += [bytes([count]), *block, checksum]
    return b"".join(out)


def _uninverted(data: bytes) -> bytes:
    """The CRC-32 of data without its final inversion."""
    return struct.pack("<I", zlib.crc32(data) ^ 0xFFFFFFFF)


def parquet(flight: Motion) -> bytes:
    """AirTouch's Parquet."""
    import pyarrow
    from pyarrow import parquet as writer

    table = pyarrow.table(si_columns(flight)).replace_schema_metadata({"airtouch": json.dumps(META)})
    sink = io.BytesIO()
    writer.write_table(table, sink)
    return sink.getvalue()


#: format -> the file's bytes from a Motion
FORMATS: dict[str, Callable[[Motion], bytes]] = {
    **{f"authors-{n}": partial(authors, width=n) for n in AUTHORS},
    "crazypad": crazypad, "imrclab": imrclab, "thrust-stand": thrust_stand, "canonical": canonical,
    "canonical-gz": lambda flight: gzip.compress(canonical(flight), 1, mtime=0),
    "usd-0": usd_old, "usd-1": lambda flight: usd(flight, 1), "usd-2": lambda flight: usd(flight, 2),
    "parquet": parquet,
}
SIZES = ((1, 0.01), (4, 0.01), (40, 0.002), (70, 0.01), (70, 0.001), (160, 0.01))  #: rows, seconds between them


def files(name: str) -> list[bytes]:
    """Sound files of one format, in several lengths and rates."""
    return [FORMATS[name](motion(rows, period, seed)) for seed, (rows, period) in enumerate(SIZES)]
