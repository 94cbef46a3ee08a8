"""A cell of the map in words: its phrase, its interval, its ratio, and what is left of it with effects in the model."""

from collections.abc import Sequence

from airtouch.gap.result import OpenCell
from airtouch.gap.signals.channels import CHANNEL_WORDS
from airtouch.gap.where import summary
from airtouch.gap.where.cell import Cell

#: each phase as a phrase
PHASE_WORDS = {"ground": "on the ground", "take-off": "at take-off", "hover": "in hover",
               "cruise": "in cruise", "over platform": "over the platform", "landing": "at landing"}
MOST_DIGITS = 5  #: of a gap with an interval; chosen, as many as are read at a glance


def in_words(cell: Cell) -> str:
    """The cell as a phrase, `over the platform, 0-0.5 Hz, roll torque: 16 rad/s^2, 18 times the floor`."""
    return f"{place_in_words(cell)}: {short(cell.gap)} {cell.unit}, {short(cell.ratio)} times the floor"


def place_in_words(cell: Cell) -> str:
    """The cell's place in the map as a phrase, `over the platform, 0-0.5 Hz, roll torque`."""
    regime = "" if cell.regime == "all" else f" ({cell.regime})"
    return f"{PHASE_WORDS[cell.phase]}{regime}, {band_in_words(cell)}, {CHANNEL_WORDS[cell.channel]}"


def band_in_words(cell: Cell | OpenCell) -> str:
    """The cell's band in words, as `0-0.5 Hz`."""
    return f"{cell.band_hz[0]:g}-{cell.band_hz[1]:g} Hz"


def gap(cell: Cell) -> str:
    """The cell's gap, with as many digits as its interval."""
    return short(cell.gap, _digits(cell))


def interval(cell: Cell) -> str:
    """The interval of the cell's gap, with enough digits that its ends differ; "" where there is none."""
    if cell.low is None or cell.high is None:
        return ""
    digits = _digits(cell)
    return f"{short(cell.low, digits)} to {short(cell.high, digits)}"


def _digits(cell: Cell) -> int:
    """Least digits, two to MOST_DIGITS, with which the ends of the interval of the cell's gap differ; else two."""
    if cell.low is None or cell.high is None:
        return 2
    return next((n for n in range(2, MOST_DIGITS + 1) if short(cell.low, n) != short(cell.high, n)), 2)


def short(value: float, digits: int = 2) -> str:
    """The value with so many digits, or its whole part where that has more; with more than two, final zeros too."""
    if abs(value) >= 10.0 ** (digits - 1):
        return f"{value:.0f}"
    return f"{value:.{digits}g}" if digits == 2 else f"{value:#.{digits}g}"


def change_in_words(cell: Cell) -> str:
    """The cell with what is left of it, as `at take-off in lift at 0-0.5 Hz (6.1 to 4 times the floor)`."""
    before, after = short(cell.ratio), short(cell.ratio_after)
    change = f"{before} to {after} times the floor" if after != before else f"{after} times the floor, as before"
    return f"{PHASE_WORDS[cell.phase]} in {CHANNEL_WORDS[cell.channel]} at {band_in_words(cell)} ({change})"


def remaining_in_words(cells: Sequence[Cell]) -> list[str]:
    """One line for each cell that stays over its floor with the named effects in the model."""
    return [change_in_words(c) + (": worse than before" if summary.got_worse(c) else "") for c in cells]
