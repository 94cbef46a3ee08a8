"""The log blocks to request from the drone, and their rows as columns of a flight log.

A packet holds 26 bytes of values. Everything that the detectors use fits into one block of 24
bytes at 100 Hz; a second, slow one carries position, attitude and the Multi-ranger.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.variables import to_columns

MOST_BYTES = 26  #: bytes of values in one log packet (LOG_MAX_LEN in the firmware)
SIZES = {"uint8_t": 1, "int8_t": 1, "uint16_t": 2, "int16_t": 2, "FP16": 2, "uint32_t": 4, "int32_t": 4,
         "float": 4}
DECIMALS = 6  #: decimals of logged values in SI units; FP16 is far coarser


@dataclass(frozen=True)
class Block:
    """A log block: name, period in ms, and (variable, type in the packet) of each value."""

    name: str
    period_ms: int
    variables: tuple[tuple[str, str], ...]

    @property
    def size(self) -> int:
        """Bytes of values in a packet."""
        return sum(SIZES[kind] for _, kind in self.variables)

    @property
    def names(self) -> tuple[str, ...]:
        """The variables' names."""
        return tuple(name for name, _ in self.variables)


def _each(group: str, names: str, kind: str) -> tuple[tuple[str, str], ...]:
    return tuple((f"{group}.{name}", kind) for name in names.split())


MOTION = Block("motion", 10, _each("acc", "x y z", "FP16") + _each("gyro", "x y z", "FP16")
               + _each("motor", "m1 m2 m3 m4", "uint16_t")
               + (("range.zrange", "uint16_t"), ("pm.vbat", "FP16")))
STATE = Block("state", 50, _each("stateEstimateZ", "x y z vx vy vz", "int16_t")
              + (("stateEstimateZ.quat", "uint32_t"),) + _each("range", "front back left right", "uint16_t")
              + (("supervisor.info", "uint16_t"),))
MULTIRANGER = frozenset(("range.front", "range.back", "range.left", "range.right"))
HELD_S = 0.25  #: s for which a value of the slow block is held; after that the sample is NaN


def check(block: Block, known: Collection[str]) -> None:
    """Raise AirTouchError if the firmware lacks a variable of the block or the block is too large for a packet."""
    missing = [name for name in block.names if name not in known]
    if missing:
        raise AirTouchError(f"the firmware has no log variable {', '.join(missing)}; "
                            "flash a newer firmware, with drivers for the attached decks")
    if block.size > MOST_BYTES:
        raise AirTouchError(f"log block {block.name}: {block.size} bytes, but a packet holds {MOST_BYTES}; "
                            "log fewer variables or shorter types")


def available(block: Block, known: Collection[str], without: Collection[str] = ()) -> Block:
    """The block with only the variables that the firmware has and that are not in `without`."""
    variables = (v for v in block.variables if v[0] in known and v[0] not in without)
    return replace(block, variables=tuple(variables))


def motion_columns(rows: Sequence[Mapping[str, float]]) -> dict[str, np.ndarray]:
    """SI columns, (n,) each, of packets of MOTION: body accelerations and rates, PWM, down range, battery."""
    return _columns(MOTION.names, rows)


def state_columns(block: Block, rows: Sequence[Mapping[str, float]]) -> dict[str, np.ndarray]:
    """SI columns, (n,) each, of packets of STATE or of the part of it that `available` gave."""
    return _columns([name for name in block.names if name != "supervisor.info"], rows)


def _columns(names: Sequence[str], rows: Sequence[Mapping[str, float]]) -> dict[str, np.ndarray]:
    table = {name: np.array([row[name] for row in rows], dtype=np.float64) for name in names}
    return {name: np.round(values, DECIMALS) for name, values in to_columns(table, {"warnings": []}).items()}


def hold(times_s: np.ndarray, slow_times_s: np.ndarray,
         slow: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Columns of the slow block at the times of the fast one, (n,) each: the last value, NaN if older than HELD_S."""
    order = np.argsort(slow_times_s, kind="stable")
    sorted_times = np.asarray(slow_times_s)[order]
    last = np.searchsorted(sorted_times, np.asarray(times_s) + 1e-9, side="right") - 1
    fresh = (last >= 0) & (times_s - sorted_times[np.maximum(last, 0)] <= HELD_S + 1e-9) if len(order) \
        else np.zeros(len(times_s), bool)
    columns = {}
    for name, values in slow.items():
        at = np.asarray(values)[order][np.maximum(last, 0)] if len(order) else np.full(len(times_s), np.nan)
        columns[name] = np.where(fresh, at, np.nan)
    return columns
