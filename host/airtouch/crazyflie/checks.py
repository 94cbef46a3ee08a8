"""Checks before take-off. Each fault is one line with its remedy."""

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass

from airtouch.errors import AirTouchError

LEAST_V = 3.7  #: V on the ground to take off; at 3.7 V a LiPo cell has a third of its charge
LOWEST_V = 3.1  #: V in flight; below it the drone lands
CONFLICTS = {"is tumbled": 5, "is locked": 6, "has crashed": 7}
#: integer types of parameters: least and greatest value
INTEGERS = {f"{sign}int{bits}_t": (0, 2**bits - 1) if sign else (-(2**(bits - 1)), 2**(bits - 1) - 1)
            for bits in (8, 16, 32, 64) for sign in ("u", "")}


@dataclass(frozen=True)
class Condition:
    """State that the drone reports: battery (V), decks by parameter, supervisor bits, down range (m)."""

    vbat_v: float
    decks: Mapping[str, bool]
    supervisor: int | None = None
    zrange_m: float | None = None

    def has(self, *decks: str) -> bool:
        """True if one of the decks is attached."""
        return any(self.decks.get(deck, False) for deck in decks)


def problems(condition: Condition, least_v: float = LEAST_V) -> list[str]:
    """Faults that forbid take-off, one line each with its remedy; empty if there are none."""
    faults = []
    if not condition.vbat_v >= least_v:
        faults.append(f"battery at {condition.vbat_v:.2f} V, less than {least_v:.2f} V; charge it "
                     "(--min-battery lowers the limit)")
    if not condition.has("bcFlow2", "bcFlow"):
        faults.append("no Flow deck found (deck.bcFlow2 is 0): without it the drone cannot hold its place; "
                     "attach it and restart the drone")
    elif condition.zrange_m is not None and not condition.zrange_m < 0.3:
        faults.append(f"the down range reads {condition.zrange_m:.2f} m on the ground; "
                     "clean or replace the Flow deck's sensor")
    if condition.supervisor is not None:
        faults += [f"the drone {what}; put it upright and restart it" for what, bit in CONFLICTS.items()
                   if condition.supervisor >> bit & 1]
    return faults


def notes(condition: Condition) -> list[str]:
    """Remarks that do not forbid take-off, one line each."""
    remarks = []
    if not condition.has("bcMultiranger"):
        remarks.append("no Multi-ranger: landmarks are not logged; the down range alone tells the true edges")
    return remarks


def parse_setting(text: str) -> tuple[str, str]:
    """(name, value) of the text "group.name=value". Raises AirTouchError for another form."""
    name, equals, value = text.partition("=")
    if not equals or name.count(".") != 1 or not value:
        raise AirTouchError(f"--param {text}: write it as group.name=value")
    return name.strip(), value.strip()


def representable(name: str, text: str, ctype: str) -> float:
    """The value as a parameter of type `ctype` stores it. Raises AirTouchError if the type cannot."""
    if ctype in INTEGERS:
        low, high = INTEGERS[ctype]
        try:
            value = int(text, 0)
        except ValueError:
            raise AirTouchError(f"{name} = {text}: the drone keeps it as {ctype}; "
                                "give a whole number") from None
        if not low <= value <= high:
            raise AirTouchError(f"{name} = {text}: out of range; "
                                f"the drone keeps it as {ctype}, {low} to {high}")
        return value
    try:
        value = struct.unpack("<f", struct.pack("<f", float(text)))[0]
    except ValueError:
        raise AirTouchError(f"{name} = {text}: the drone keeps it as {ctype}; give a number") from None
    except OverflowError:
        raise AirTouchError(f"{name} = {text}: out of range for {ctype}") from None
    if not math.isfinite(value):
        raise AirTouchError(f"{name} = {text}: give a finite number")
    return value
