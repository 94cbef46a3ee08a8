"""The answer of a diagnosis in three sentences: where, which, how far."""

from collections.abc import Sequence
from pathlib import Path

from airtouch.gap.answer.words import joined, name_in_words, quantity, rotors_in_words
from airtouch.gap.result import FITTED, REST_OF_FLIGHT, Diagnosis, NamedEffect, OpenCell, RankedCandidate
from airtouch.gap.signals.channels import CHANNEL_WORDS
from airtouch.gap.signatures.candidates import is_random, random_of, terms_of
from airtouch.gap.signatures.signature import OVERHEAD
from airtouch.gap.where import summary
from airtouch.gap.where.cell import Cell
from airtouch.gap.where.cell_words import PHASE_WORDS, band_in_words, change_in_words, short

MOTOR_NOISE = "motor_noise"  #: what recorded flights are often called without a baseline (host/docs/gap.md)
LEAST_PROBABILITY = 0.0005  #: of the nearest effect, to be named: a smaller one would be shown as 0.0 %


def sentences(diagnosis: Diagnosis) -> tuple[str, str, str]:
    """Where the gap lies, which effect it is and how probable that is, how far it closes."""
    return _where(diagnosis), _which(diagnosis), _how_far(diagnosis)


def unsteady_cell(diagnosis: Diagnosis) -> OpenCell | None:
    """What is shaken in a flight that is less steady than nominal ones; None in any other."""
    return next((cell for cell in diagnosis.unexplained if cell.floor == REST_OF_FLIGHT), None)


def _where(diagnosis: Diagnosis) -> str:
    """The seconds of an unsteady flight; else the headline, and in how many phases its channel and band stand out."""
    cell, shaken = diagnosis.headline, unsteady_cell(diagnosis)
    if shaken is not None:
        return (f"The flight is less steady than nominal ones: {CHANNEL_WORDS[shaken.channel]} at "
                f"{band_in_words(shaken)} is up to {short(shaken.over_floor)} times that of the rest of the flight "
                f"from {shaken.from_s:.1f} to {shaken.to_s:.1f} s of {Path(shaken.flight).name}.")
    if cell is None:
        return "In no cell of the map does the gap stand out from its floor."
    cells = diagnosis.map.cells if diagnosis.map else diagnosis.where
    standing_out = len({c.phase for c in summary.same_place(cells, cell)})
    flown = len({c.phase for c in cells if c.phase != summary.GROUND_NAME})
    place = f"{CHANNEL_WORDS[cell.channel]} at {band_in_words(cell)}: {PHASE_WORDS[cell.phase]} it is"
    if not summary.stands_out(cell):
        return (f"The effect named takes most from {place} {short(cell.gap)} {cell.unit} without and "
                f"{short(cell.gap if cell.after is None else cell.after)} {cell.unit} with it. No single cell that it "
                "halves stands out from its floor.")
    most = summary.headline(cells) or cell  # the effects named may close another
    begin = "The gap lies mostly" if summary.same_place([cell], most) else "A part of the gap lies"
    return (f"{begin} in {place} {short(cell.gap)} {cell.unit}, {short(cell.ratio)} times the floor"
            + (f", and it stands out in {standing_out} of {flown} phases in the air." if flown > 1 else "."))


def _which(diagnosis: Diagnosis) -> str:
    """The effects named with their probability; where none is, what comes nearest."""
    probability = f"{diagnosis.ranking[0].probability:.0%}" if diagnosis.ranking else "not known"
    if diagnosis.verdict == "none":
        return f"No unmodelled effect stands out (probability {probability})."
    if diagnosis.verdict == "unknown":
        if diagnosis.ranking and all(r.name in ("none", "unknown") for r in diagnosis.ranking):
            return f"Something acts (probability {probability}), but no effect was tried."
        near = next((r for r in diagnosis.ranking if r.name not in ("none", "unknown")
                     and r.probability >= LEAST_PROBABILITY), None)
        return (f"No known effect explains it (probability {probability})"
                + (f"; the nearest is {name_in_words(near.name)} with {near.probability:.1%}." if near else "."))
    first, *others = (_named(e) for e in diagnosis.effects)
    cell, they = diagnosis.headline, "they do" if others else "it does"
    beside = f", with {joined(others)} beside it" if others else ""
    caveat = _without_baseline(diagnosis)
    cause = f"Its cause is {first} (probability {probability}){beside}"
    if diagnosis.ranking and diagnosis.ranking[0].rotor_sets:
        cause = _cause_by_rotors(diagnosis.ranking[0])
    if cell is None or not summary.stands_out(cell):
        return f"{cause}: so say all cells together.{caveat}"
    if cell.after is not None and not summary.shrinks(cell):
        return f"{cause}: so say all cells together, though {they} not shrink this one, nor halve any other.{caveat}"
    return f"{cause}.{caveat}"


def _cause_by_rotors(answer: RankedCandidate) -> str:
    """The cause with its probability, whichever rotors it is of, and the likeliest rotors with theirs."""
    likeliest = answer.rotor_sets[0]
    return (f"Its cause is {name_in_words(answer.name)} (probability {answer.probability:.0%}), most likely of "
            f"{rotors_in_words(likeliest.rotors)} ({likeliest.probability:.0%})")


def _without_baseline(diagnosis: Diagnosis) -> str:
    """The caveat of noise that is named without a baseline, "" where there is none to make."""
    noise = [name_in_words(e.name) for e in diagnosis.effects if e.name == MOTOR_NOISE]
    return (f" Without --baseline that is no sure answer: a recorded flight is then often called {noise[0]}."
            if noise and not diagnosis.baseline else "")


def _named(effect: NamedEffect) -> str:
    """The effect's name, and of which rotor."""
    rotor = effect.parameters.get("rotor")
    return (name_in_words(effect.name) + (f" of rotor {rotor.value:.0f}" if rotor else "")
            + (", the wake of another vehicle overhead" if effect.name == OVERHEAD else ""))


def _how_far(diagnosis: Diagnosis) -> str:
    """How far the effects named close the gap; how large it is where none is named."""
    before, after = diagnosis.gap.get("before"), diagnosis.gap.get("after")
    if before is None or after is None:
        return "How far it would close is not known."
    if diagnosis.verdict == "none":
        if short(before) == "1":
            return "The gap over all cells is at the floor, so there is nothing to close."
        return f"The gap over all cells is {short(before)} times the floor; nominal flights may differ by as much."
    if diagnosis.verdict == "unknown" and before <= 1.0:
        return ("Over all the gap is at the floor: what acts, acts in some seconds only." if unsteady_cell(diagnosis)
                else "Over all the gap is at the floor, but the signals do not fit a flight without an effect.")
    if diagnosis.verdict != "effect" or diagnosis.shrink is None:
        return f"Nothing closes it yet: the gap over all cells stays {short(before)} times the floor."
    added, they = ("it", "it was") if len(diagnosis.effects) == 1 else ("them", "they were")
    data = f"that {they} fitted to" if diagnosis.judged_on == FITTED else "held out"
    return (f"Adding {added} to the simulator takes away {quantity(diagnosis.shrink, '{:z.0%}')} of the gap above the "
            f"floor on data {data}, from {short(before)} to {short(after)} times the floor"
            f"{_cells_in_words(diagnosis.map.cells if diagnosis.map else diagnosis.where)}."
            f"{_why_cells_stay(diagnosis)}")


def _why_cells_stay(diagnosis: Diagnosis) -> str:
    """Why single cells grow while the gap closes, where an effect named acts at random; "" where none does."""
    cells = diagnosis.map.cells if diagnosis.map else diagnosis.where
    at_random = any(is_random(e.name) or random_of(terms_of(e)) for e in diagnosis.effects)
    if not at_random or not summary.worse(cells):
        return ""
    return (" What acts at random is known by its mean power, not by its course: this share counts all cells together, "
            "and a single cell may shrink less or grow.")


def _cells_in_words(cells: Sequence[Cell]) -> str:
    """How many cells still stand out with the effects named, and how many got worse; "" where neither."""
    open_cells, worse_cells = summary.remaining(cells), summary.worse(cells)
    over = sum(c.regime == "all" and summary.stands_out(c) for c in cells)
    still = sum(summary.stands_out(c) for c in open_cells)
    out = ""
    if open_cells:
        new = f", beside {len(open_cells) - still} that did not before" if len(open_cells) > still else ""
        out = f"; {still} of {over} cells still stand out{new}, mostly {change_in_words(open_cells[0])}"
    return out + (f", and {len(worse_cells)} got worse" if worse_cells else "")
