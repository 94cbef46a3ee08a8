"""A diagnosis in sentences, for the terminal and the report alike."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from airtouch.gap.gap_map import CHANNEL_WORDS, LEAST_SHARE, PHASE_WORDS, in_words, short
from airtouch.gap.result import Cell, Diagnosis, Found, Quantity


def answer(diagnosis: Diagnosis) -> str:
    """The result in one sentence: how much of the gap is which effect, before, after and floor."""
    if diagnosis.verdict == "none":
        return "No unmodelled effect stands out: what these flights leave of the model is the floor."
    names = joined([e.name.replace("_", " ") for e in diagnosis.effects])
    cell = telling(diagnosis)
    if diagnosis.verdict == "unknown":
        where = f" It is largest {in_words(diagnosis.where[0])}." if diagnosis.where else ""
        also = f" besides {names}" if names else ""
        return f"There is a gap{also} that no known effect explains.{where}"
    if cell is None:
        return f"The gap is {names}{_shrink(diagnosis)}."
    others = [e.name.replace("_", " ") for e in diagnosis.effects if e.name != cell.by] if cell.by else []
    cause = cell.by.replace("_", " ") if cell.by else names
    added = "it" if cell.by or len(diagnosis.effects) == 1 else "them"
    part = f"{share(cell):.0%}" if share(cell) < 0.995 else "Nearly all"
    return (f"{part} of the gap {PHASE_WORDS[cell.phase]} in {CHANNEL_WORDS[cell.channel]} "
            f"({cell.band_hz[0]:g}-{cell.band_hz[1]:g} Hz) is {cause}; adding {added} "
            + (f"with {joined(others)} " if others else "") + f"shrinks the gap from {short(cell.gap)} to "
            f"{short(cell.after)} {cell.unit}, floor {short(cell.floor)}.")


def telling(diagnosis: Diagnosis) -> Cell | None:
    """The cell that the named effects take most from, in units of its floor; None where they take little."""
    better = [c for c in diagnosis.where if c.after is not None and share(c) > LEAST_SHARE]
    return max(better, key=lambda c: (c.gap - c.after) / max(c.floor_high or c.floor, 1e-12), default=None)


def share(cell: Cell) -> float:
    """Part of a cell's gap above its floor that the named effects take away, 0 to 1."""
    if cell.after is None or cell.gap <= cell.floor:
        return 0.0
    return min(max((cell.gap - cell.after) / (cell.gap - cell.floor), 0.0), 1.0)


def effect_in_words(effect: Found) -> str:
    """`weak_motor: rotor 3, thrust_loss 0.11 (0.09 to 0.13)`; of one that comes and goes, when it acts."""
    when = ", ".join(f"{begin:.1f} to {end:.1f} s of {Path(flight).name}" for flight, begin, end in effect.seconds)
    return (f"{effect.name}: " + ", ".join(f"{k} {quantity(q)}" for k, q in effect.parameters.items())
            + (f"; acts from {when}" if when else ""))


def open_in_words(entry: Mapping[str, Any]) -> str:
    """`lift, 0.5-2 Hz, cruise: up to 6.1 times the floor from 12.0 to 18.4 s of log.csv; follows height`."""
    low, high = entry["band_hz"]
    follows = f"; follows {joined(list(entry['follows']))}" if entry["follows"] else ""
    return (f"{CHANNEL_WORDS[entry['channel']]}, {low:g}-{high:g} Hz, {entry['phase']}: up to {entry['over_floor']:.1f} times the "
            f"floor from {entry['from_s']:.1f} to {entry['to_s']:.1f} s of {Path(entry['flight']).name}{follows}")


def quantity(q: Quantity, form: str = "{:.3g}") -> str:
    """A number with unit and interval."""
    unit = "" if q.unit in ("1", "") else f" {q.unit}"
    interval = "" if q.low is None or q.high is None else f" ({form.format(q.low)} to {form.format(q.high)})"
    return form.format(q.value) + unit + interval


def joined(names: list[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def _shrink(diagnosis: Diagnosis) -> str:
    if diagnosis.shrink is None:
        return ""
    return f"; adding it shrinks the gap by {quantity(diagnosis.shrink, '{:.0%}')} on data held out"


def rotor_in_words(rotor: Mapping[str, float]) -> str:
    """`rotor 1: 19600 rpm logged, 0.96 of the model's (0.95 to 0.97 over 6 flights)`."""
    return (f"rotor {rotor['rotor']}: {rotor['logged']:.0f} rpm logged, {rotor['ratio']:.3f} of the model's "
            f"({rotor['low']:.3f} to {rotor['high']:.3f} over {rotor['flights']} flights)")
