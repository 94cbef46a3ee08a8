"""A cell of the map in words: its phrase, its interval, its ratio."""

from airtouch.gap.result import Cell
from airtouch.gap.signals.channels import CHANNEL_WORDS
from airtouch.gap.where.summary import SMALLEST_FLOOR

#: each phase as a phrase
PHASE_WORDS = {"ground": "on the ground", "take-off": "at take-off", "hover": "in hover",
               "cruise": "in cruise", "over platform": "over the platform", "landing": "at landing"}


def in_words(cell: Cell) -> str:
    """The cell as a phrase, `over the platform, 0-0.5 Hz, roll torque: 16 rad/s^2, 18 times the floor`."""
    return f"{place_in_words(cell)}: {short(cell.gap)} {cell.unit}, {short(ratio(cell))} times the floor"


def place_in_words(cell: Cell) -> str:
    """The cell's place in the map as a phrase, `over the platform, 0-0.5 Hz, roll torque`."""
    regime = "" if cell.regime == "all" else f" ({cell.regime})"
    return (f"{PHASE_WORDS[cell.phase]}{regime}, {cell.band_hz[0]:g}-{cell.band_hz[1]:g} Hz, "
            f"{CHANNEL_WORDS[cell.channel]}")


def interval(cell: Cell) -> str:
    """The interval of the cell's gap, "" where there is none."""
    return "" if cell.low is None or cell.high is None else f"{short(cell.low)} to {short(cell.high)}"


def short(value: float) -> str:
    """The value with two digits, or its whole part where that has more."""
    return f"{value:.0f}" if abs(value) >= 10.0 else f"{value:.2g}"


def ratio(cell: Cell) -> float:
    """The cell's gap over its floor."""
    return cell.gap / max(cell.floor, SMALLEST_FLOOR)
