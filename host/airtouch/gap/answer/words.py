"""A diagnosis in sentences, for the terminal, the report and the JSON alike."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from airtouch.gap.result import Cell, Diagnosis, NamedEffect, OpenCell, Quantity, RankedCandidate
from airtouch.gap.signals.channels import CHANNEL_WORDS
from airtouch.gap.where import summary
from airtouch.gap.where.cell_words import PHASE_WORDS, in_words, ratio, short
from airtouch.gap.where.rotor_speeds import RotorSpeed

MOST_RANKED = 10  #: candidates of a ranking that are shown; chosen


def answer(diagnosis: Diagnosis) -> str:
    """The answer in three sentences: where, which, how far."""
    return " ".join(sentences(diagnosis))


def sentences(diagnosis: Diagnosis) -> tuple[str, str, str]:
    """Where the gap lies, which effect it is and how probable that is, how far it closes."""
    return _where(diagnosis), _which(diagnosis), _how_far(diagnosis)


def _where(diagnosis: Diagnosis) -> str:
    """The cell that the answer speaks of, and in how many phases of flight its channel and band stand out."""
    cell = diagnosis.headline
    if cell is None:
        return "In no cell of the map does the gap stand out of its floor."
    cells = diagnosis.map.cells if diagnosis.map else diagnosis.where
    standing_out = len({c.phase for c in summary.same_place(cells, cell)})
    flown = len({c.phase for c in cells if c.phase != summary.GROUND_NAME})
    most = summary.headline(cells) or cell  # the effects named may close another
    share = "The gap lies mostly" if summary.same_place([cell], most) else "A part of the gap lies"
    return (f"{share} in {CHANNEL_WORDS[cell.channel]} at {band_in_words(cell)}: "
            f"{PHASE_WORDS[cell.phase]} it is {short(cell.gap)} {cell.unit}, {short(ratio(cell))} times the floor"
            + (f", and it stands out in {standing_out} of {flown} phases in the air." if flown > 1 else "."))


def _which(diagnosis: Diagnosis) -> str:
    """The effects named with their probability; where none is, what comes nearest."""
    chance = f"{diagnosis.ranking[0].probability:.0%}" if diagnosis.ranking else "not known"
    if diagnosis.verdict == "none":
        return f"No unmodelled effect stands out (probability {chance})."
    if diagnosis.verdict == "unknown":
        near = next((r for r in diagnosis.ranking if r.name not in ("none", "unknown")), None)
        return (f"No known effect explains it (probability {chance})"
                + (f"; the nearest is {name_in_words(near.name)} with {near.probability:.1%}." if near else "."))
    first, *others = (_named(e) for e in diagnosis.effects)
    cell = diagnosis.headline
    if cell is not None and cell.after is not None and not summary.closes(cell):
        sentence = f"The effect named, {first} (probability {chance}), does not close this cell"
        return sentence + (f", nor does {joined(others)} beside it." if others else ".")
    begin = "Its cause" if cell is not None else "The effect named, from all cells together,"
    return f"{begin} is {first} (probability {chance})" + (f", with {joined(others)} beside it." if others else ".")


def _named(effect: NamedEffect) -> str:
    """The effect's name, and of which rotor."""
    rotor = effect.parameters.get("rotor")
    return name_in_words(effect.name) + (f" of rotor {rotor.value:.0f}" if rotor else "")


def _how_far(diagnosis: Diagnosis) -> str:
    """How far the effects named close the gap; how large it is where none is named."""
    before, after = diagnosis.gap.get("before"), diagnosis.gap.get("after")
    if before is None or after is None:
        return "How far it would close is not known."
    if diagnosis.verdict == "none":
        if short(before) == "1":
            return "Over all it is at the floor, so there is nothing to close."
        return f"Over all it is {short(before)} times the floor; nominal flights may differ by as much."
    if diagnosis.verdict != "effect" or diagnosis.shrink is None:
        return f"Nothing closes it yet: over all it stays {short(before)} times the floor."
    added = "it" if len(diagnosis.effects) == 1 else "them"
    return (f"Adding {added} to the simulator takes away {quantity(diagnosis.shrink, '{:.0%}')} of the gap above the "
            f"floor on data held out, from {short(before)} to {short(after)} times the floor"
            f"{_cells_in_words(diagnosis.map.cells if diagnosis.map else diagnosis.where)}.")


def _cells_in_words(cells: Sequence[Cell]) -> str:
    """How many cells still stand out with the effects named, and how many got worse; "" where neither."""
    open_cells, worse_cells = summary.remaining(cells), summary.worse(cells)
    over = sum(c.regime == "all" and summary.stands_out(c) for c in cells)
    still = sum(summary.stands_out(c) for c in open_cells)
    out = ""
    if open_cells:
        new = f", beside {len(open_cells) - still} that did not before" if len(open_cells) > still else ""
        out = f"; {still} of {over} cells still stand out{new}, mostly {_after_in_words(open_cells[0])}"
    return out + (f", and {len(worse_cells)} got worse" if worse_cells else "")


def _after_in_words(cell: Cell) -> str:
    """The cell with what is left of it, as `at take-off in lift at 0-0.5 Hz (6.1 to 4 times the floor)`."""
    before, after = short(ratio(cell)), short(summary.ratio_after(cell))
    change = f"{before} to {after} times the floor" if after != before else f"{after} times the floor, as before"
    return f"{PHASE_WORDS[cell.phase]} in {CHANNEL_WORDS[cell.channel]} at {band_in_words(cell)} ({change})"


def remaining_in_words(cells: Sequence[Cell]) -> list[str]:
    """One line for each cell that stays over its floor with the named effects in the model."""
    return [_after_in_words(c) + (": worse than before" if summary.got_worse(c) else "") for c in cells]


def band_in_words(cell: Cell | OpenCell) -> str:
    """The band in words, as `0-0.5 Hz`."""
    return f"{cell.band_hz[0]:g}-{cell.band_hz[1]:g} Hz"


def name_in_words(name: str) -> str:
    """An effect's name as a phrase."""
    return name.replace("_", " ")


def effect_in_words(effect: NamedEffect) -> str:
    """The effect with its parameters, as `weak_motor: rotor 3, thrust_loss 0.11 (0.09 to 0.13)`, and when it acts."""
    when = seconds_in_words(effect)
    return (f"{effect.name}: " + ", ".join(f"{k} {quantity(q)}" for k, q in effect.parameters.items())
            + (f"; acts from {when}" if when else ""))


def seconds_in_words(effect: NamedEffect) -> str:
    """When an effect acts, "" where it always does."""
    return ", ".join(f"{begin:.1f} to {end:.1f} s of {Path(flight).name}" for flight, begin, end in effect.seconds)


def all_open_in_words(cells: Sequence[OpenCell]) -> list[str]:
    """One line for each place where the gap stays open. Phases that share their worst seconds share a line."""
    lines: dict[str, list[OpenCell]] = {}
    for cell in cells:
        lines.setdefault(open_in_words(replace(cell, phase="")), []).append(cell)
    return [open_in_words(replace(alike[0], phase=joined([c.phase for c in alike]))) for alike in lines.values()]


def open_in_words(cell: OpenCell) -> str:
    """What stays open, as `lift, 0.5-2 Hz, cruise: up to 6.1 times the floor from 12.0 to 18.4 s of log.csv`."""
    follows = f"; follows {joined(list(cell.follows))}" if cell.follows else ""
    return (f"{CHANNEL_WORDS[cell.channel]}, {band_in_words(cell)}, {cell.phase}: up to {cell.over_floor:.1f} times "
            f"the floor from {cell.from_s:.1f} to {cell.to_s:.1f} s of {Path(cell.flight).name}{follows}")


def nearest_in_words(diagnosis: Diagnosis) -> list[str]:
    """Why each of the nearest effects was not named, of those that the ranking does not show with a reason."""
    if not diagnosis.unexplained:
        return []
    shown = {r.name for r in leading(diagnosis.ranking) if r.why}
    near = [r for r in diagnosis.unexplained[0].nearest if r.name not in shown]
    return [f"{name_in_words(r.name)}: {r.fails}" for r in near]


def leading(ranking: Sequence[RankedCandidate]) -> list[RankedCandidate]:
    """The candidates that are shown: the first MOST_RANKED, and `none` and `unknown` wherever they are."""
    return [r for i, r in enumerate(ranking) if i < MOST_RANKED or r.name in ("none", "unknown")]


def digits(q: Quantity) -> str:
    """The format that shows a number, and its interval as an interval: three digits, six at most."""
    if q.low is None or q.high is None or q.low == q.high:
        return "{:.3g}"
    forms = (f"{{:.{n}g}}" for n in (3, 4, 5))
    return next((form for form in forms if form.format(q.low) != form.format(q.high)), "{:.6g}")


def quantity(q: Quantity, form: str | None = None) -> str:
    """A number with unit and interval."""
    form = form or digits(q)
    unit = "" if q.unit in ("1", "") else f" {q.unit}"
    interval = "" if q.low is None or q.high is None else f" ({form.format(q.low)} to {form.format(q.high)})"
    return form.format(q.value) + unit + interval


def joined(names: list[str]) -> str:
    """The names as a list in words: `a`, `a and b`, `a, b and c`."""
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def measured_in_words(where: Cell | None) -> str:
    """The answer of a measurement: where most of the gap lies."""
    return f"Most of the gap lies {in_words(where)}." if where else "No gap stands out of the floor."


def overall_in_words(gap: Mapping[str, float]) -> str:
    """The gap of a measurement in a sentence."""
    return f"Overall it is {gap['before']:.2g} times the floor" + (
        f", {gap['calibrated']:.2g} times with the vehicle calibrated on the baseline flights."
        if "calibrated" in gap else ".")


def rotor_in_words(speed: RotorSpeed) -> str:
    """A rotor's speeds, as `rotor 1: 19600 rpm logged, 0.96 of the model's (0.95 to 0.97 over 6 flights)`."""
    return (f"rotor {speed.rotor}: {speed.logged:.0f} rpm logged, {speed.ratio:.3f} of the model's "
            f"({speed.low:.3f} to {speed.high:.3f} over {speed.flights} flights)")
