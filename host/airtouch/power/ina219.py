"""CSV logs of an INA219 power meter (time, bus voltage, current), and mean power with its interval."""

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from airtouch.errors import AirTouchError

#: unit in a column's name -> its factor to SI
UNITS = {"ms": 1e-3, "us": 1e-6, "s": 1.0, "mv": 1e-3, "v": 1.0, "ma": 1e-3, "ua": 1e-6, "a": 1.0}
#: quantity -> first words of a column's name that mean it: those of common INA219 sketches
QUANTITIES = {"time": ("time", "t", "millis", "timestamp"),
              "volts": ("bus", "voltage", "volts", "volt", "v", "u"),
              "amperes": ("current", "amperes", "i"), "stage": ("stage", "phase", "module")}
UNITS_OF = {"time": ("ms", "us", "s"), "volts": ("mv", "v"), "amperes": ("ma", "ua", "a")}
OTHER_UNITS = ("mw", "uw", "w", "mj", "j", "mah", "ah", "mwh", "wh", "ohm", "ohms", "hz", "c")
MEASURED = ("time", "volts", "amperes")
#: factor to seconds of a time column whose name says no unit; other columns are SI
FACTORS = {"millis": 1e-3, "timestamp": 1.0, "time": 1.0, "t": 1.0}
#: quantity -> (column, factor to SI) of a log without header: what tools/power/ina219_logger.ino writes
WITHOUT_HEADER = {"time": (0, 1e-3), "volts": (1, 1.0), "amperes": (2, 1e-3), "stage": (3, 1.0)}
#: fraction of unreadable lines up to which a log is read: serial ports lose some; no source: round number
MOST_BAD = 0.05
MOST_V, MOST_A = 26.0, 3.2  #: V and A, the INA219's range
GAP = 20.0  #: sample periods; no energy is counted over a longer gap; no source: round number
LONGEST_PERIOD_S = 0.5  #: s between lines, to which a time without a unit counts as seconds; no source: round number
BLOCK_S = 1.0  #: s, block length of the interval; no source: chosen to be longer than the noise is correlated


@dataclass(frozen=True)
class Trace:
    """A power log: time (s), volts and amperes, each (n,), the stage of each line, and warnings."""

    time_s: np.ndarray
    volts: np.ndarray
    amperes: np.ndarray
    stage: tuple[str, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Power:
    """Mean power (mW) with the half width of its 95 % interval, energy (mJ), seconds and lines."""

    mw: float
    half_mw: float
    mj: float
    seconds: float
    lines: int


def parse(text: str, source: str) -> Trace:
    """The power log in a text. Raises AirTouchError with file, line and remedy.

    Comments, empty lines, repeated headers, a truncated last line and at most MOST_BAD damaged lines are
    skipped and counted. Separators are , ; or tab. With ; or tab the decimal point may be a comma.
    """
    lines = [(i, line.strip()) for i, line in enumerate(text.lstrip("\ufeff").splitlines(), 1)]
    lines = [(i, line) for i, line in lines if line and not line.startswith("#")]
    if not lines:
        raise AirTouchError(f"{source}: no data in it; log again")
    separator = next((s for s in "\t;" if s in lines[0][1]), ",")
    first = _cells(lines[0][1], separator)
    header = first if _number(first[0]) is None else None
    columns = _columns(header, source, lines[0][0]) if header else WITHOUT_HEADER
    rows, stages, bad = [], [], []
    for i, line in lines[1:] if header else lines:
        cells = _cells(line, separator)
        if cells == header:
            continue
        read = [_number(cells[at].replace(",", ".")) if at < len(cells) else None
                for at, _ in (columns[q] for q in MEASURED)]
        row = [v for v in read if v is not None]
        if len(row) < len(read) or not _possible(row, columns):
            bad.append(i)
            continue
        rows.append([v * columns[q][1] for v, q in zip(row, MEASURED, strict=True)])
        at = columns.get("stage", (len(cells), 1.0))[0]
        stages.append(cells[at] if at < len(cells) else "")
    if len(bad) > max(MOST_BAD * (len(rows) + len(bad)), 1):
        total = len(rows) + len(bad)
        raise AirTouchError(f"{source}:{bad[0]}: {len(bad)} of {total} lines are no time, voltage (0 to "
                            f"{MOST_V:g} V) and current (to {MOST_A:g} A); check the columns and their units")
    if len(rows) < 2:
        raise AirTouchError(f"{source}: {len(rows)} usable lines; log for some seconds")
    notes = [f"{source}: {len(bad)} damaged lines passed over, the first is {bad[0]}"] if bad else []
    table = np.array(rows)
    if header:
        _check_seconds(table[:, 0], header[columns["time"][0]], f"{source}:{lines[0][0]}")
    return Trace(table[:, 0], table[:, 1], table[:, 2], tuple(stages), tuple(notes))


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, quoting=csv.QUOTE_NONE))]


def _number(cell: str) -> float | None:
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _possible(row: list[float], columns: dict[str, tuple[int, float]]) -> bool:
    return 0.0 <= row[1] * columns["volts"][1] <= MOST_V and abs(row[2] * columns["amperes"][1]) <= MOST_A


def _words(name: str) -> list[str]:
    return [w for w in re.split(r"[^a-z]+", name.lower()) if w]


def _unit(words: list[str]) -> str | None:
    return next((w for w in words[1:][::-1] if w in UNITS), None)


def _period(time_s: np.ndarray) -> float:
    """Median of the steps forward, s; 0 without one."""
    steps = np.diff(time_s)
    return float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0


def _check_seconds(time_s: np.ndarray, name: str, where: str) -> None:
    """Raise AirTouchError if a time column without a unit in its name is unlikely to be in seconds."""
    words, period = _words(name), _period(time_s)
    if _unit(words) is None and FACTORS[words[0]] == 1.0 and period > LONGEST_PERIOD_S:
        raise AirTouchError(f"{where}: the column {name!r} names no unit, and in seconds its lines are {period:g} s "
                            "apart; name it time_ms, time_us or time_s")


def _columns(header: list[str], source: str, line: int) -> dict[str, tuple[int, float]]:
    """Quantity -> (column, factor to SI) from names like time_ms, "Bus Voltage (V)", current_mA."""
    columns: dict[str, tuple[int, float]] = {}
    for at, name in enumerate(header):
        words = _words(name)
        unit = _unit(words)
        for quantity, known in QUANTITIES.items():
            if quantity not in columns and words and words[0] in known and not _other_unit(quantity, words[1:]):
                columns[quantity] = (at, UNITS[unit] if unit else FACTORS.get(words[0], 1.0))
                break
    missing = [q for q in ("time", "volts", "amperes") if q not in columns]
    if missing:
        raise AirTouchError(f"{source}:{line}: no column for {', '.join(missing)} in {', '.join(header)!r}; "
                            "name them time_ms, bus_V, current_mA")
    return columns


def _other_unit(quantity: str, words: list[str]) -> bool:
    """True if the words after the first of a column's name have a unit, and none of this quantity: bus_power_mW."""
    units = [w for w in words if w in UNITS or w in OTHER_UNITS]
    return quantity in MEASURED and bool(units) and units[-1] not in UNITS_OF[quantity]


def power(trace: Trace, where: np.ndarray | None = None) -> Power:
    """Mean power over the lines where `where`, (n,) bool, is true, by the trapezoidal rule.

    Gaps of more than 20 sample periods, and the backward step of a clock that was reset, are left out.
    The 95 % interval is Student's t over the means of blocks of one second; NaN with fewer than two blocks.
    """
    watts = trace.volts * trace.amperes
    steps = np.diff(trace.time_s)
    joined = (steps > 0) & (steps <= max(GAP * _period(trace.time_s), 1e-9))
    if where is not None:
        joined &= where[1:] & where[:-1]
    seconds = float(steps[joined].sum())
    if seconds <= 0.0:
        return Power(math.nan, math.nan, 0.0, 0.0, 0)
    pieces = steps * (watts[1:] + watts[:-1]) / 2.0
    joules = float(pieces[joined].sum())
    block = (np.cumsum(np.where(joined, steps, 0.0))[joined] / BLOCK_S).astype(int)
    spans = np.bincount(block, steps[joined])
    means = (np.bincount(block, pieces[joined]) / np.maximum(spans, 1e-12))[spans > 0.5 * BLOCK_S]
    half = math.nan
    if len(means) > 1:
        half = float(stdtrit(len(means) - 1, 0.975) * means.std(ddof=1)) / math.sqrt(len(means))
    return Power(1e3 * joules / seconds, 1e3 * half, 1e3 * joules, seconds, int(joined.sum()) + 1)


def by_stage(trace: Trace, known: Sequence[str]) -> dict[str, Power]:
    """Power of each stage in a log's stage column: first the stages in `known`, in that order, then others by name."""
    names = np.array([canonical(name, known) for name in trace.stage])
    order = list(dict.fromkeys([*(s for s in known if s in names), *sorted(set(names) - {""})]))
    return {name: power(trace, names == name) for name in order}


def canonical(name: str, known: Sequence[str]) -> str:
    """The name in `known` that equals `name` but for case and punctuation; without one `name` itself."""
    plain = {re.sub(r"[^a-z0-9]", "", s.lower()): s for s in known}
    return plain.get(re.sub(r"[^a-z0-9]", "", name.lower()), name)


def added_power(stages: dict[str, Power]) -> dict[str, tuple[float, float]]:
    """Stage -> (mW added to the stage before it, half width of the 95 % interval). The first stage counts in full."""
    result, before = {}, None
    for name, power in stages.items():
        half = power.half_mw if before is None else math.hypot(power.half_mw, before.half_mw)
        result[name] = (power.mw - (before.mw if before else 0.0), half)
        before = power
    return result
