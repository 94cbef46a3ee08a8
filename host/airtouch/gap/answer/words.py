"""Parts of a diagnosis in words: numbers, effects, what stays open, candidates that are shown."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from airtouch.gap.result import FITTED, REST_OF_FLIGHT, Diagnosis, NamedEffect, OpenCell, Quantity, RankedCandidate
from airtouch.gap.signals.channels import CHANNEL_WORDS
from airtouch.gap.where.cell_words import band_in_words

MOST_RANKED = 10  #: candidates of a ranking that are shown; chosen. A larger number makes a longer table
SHRINK_FORM = "{:z.2f}"  #: format of a shrink; z: 0.00, not -0.00
VANISHING = 1e-6  #: of the larger end of its interval, below which a value is 0: rounding errors; chosen
DECIMALS = 1  #: of the seconds and ratios of an open cell that are shown


def format_of(q: Quantity) -> str:
    """The format of a number, as `{:.3g}`: three digits, or up to six so that the ends of its interval differ."""
    if q.low is None or q.high is None or q.low == q.high:
        return "{:.3g}"
    forms = (f"{{:.{n}g}}" for n in (3, 4, 5))
    return next((form for form in forms if form.format(q.low) != form.format(q.high)), "{:.6g}")


def quantity(q: Quantity, form: str | None = None) -> str:
    """A number with unit and interval."""
    form = form or format_of(q)
    unit = "" if q.unit in ("1", "") else f" {q.unit}"
    interval = "" if q.low is None or q.high is None else f" ({form.format(q.low)} to {form.format(q.high)})"
    return form.format(printed_value(q)) + unit + interval


def printed_value(q: Quantity) -> float:
    """The value, and 0 where it is so small beside the ends of its interval that its digits mean nothing."""
    ends = max((abs(end) for end in (q.low, q.high) if end is not None), default=0.0)
    return 0.0 if abs(q.value) < VANISHING * ends else q.value


def joined(names: list[str]) -> str:
    """The names as a list in words: `a`, `a and b`, `a, b and c`."""
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def name_in_words(name: str) -> str:
    """An effect's name as a phrase."""
    return name.replace("_", " ")


def rotors_in_words(rotors: Sequence[int]) -> str:
    """Rotors as a phrase: `rotor 1`, `rotors 1 and 3`."""
    return f"rotor{'s' * (len(rotors) > 1)} {joined([str(r) for r in rotors])}"


def effect_in_words(effect: NamedEffect) -> str:
    """The effect with its parameters, as `weak_motor: rotor 3, thrust_loss 0.11 (0.09 to 0.13)`, and when it acts."""
    when = seconds_in_words(effect)
    return (f"{effect.name}: " + ", ".join(f"{k} {quantity(q)}" for k, q in effect.parameters.items())
            + (f"; acts from {when}" if when else ""))


def seconds_in_words(effect: NamedEffect) -> str:
    """When an effect acts, as `1.0 to 1.6 s and 6.4 to 7.0 s of log.csv`; "" where it always does."""
    return ", ".join(f"{joined([f'{begin:.1f} to {end:.1f} s' for _, begin, end in intervals])} of {Path(flight).name}"
                     for flight, intervals in groupby(effect.seconds, key=lambda interval: interval[0]))


def all_open_in_words(cells: Sequence[OpenCell]) -> list[str]:
    """One line for each place where the gap stays open."""
    return [open_in_words(cell) for cell in cells]


def open_in_words(cell: OpenCell) -> str:
    """What stays open, as `lift, 0.5-2 Hz, cruise: up to 6.1 times the floor from 12.0 to 18.4 s of log.csv`."""
    follows = f"; follows {joined(list(cell.follows))}" if cell.follows else ""
    floor = "that of the rest of the flight" if cell.floor == REST_OF_FLIGHT else "the floor"
    return (f"{CHANNEL_WORDS[cell.channel]}, {band_in_words(cell)}, {cell.phase}: up to {cell.over_floor:.{DECIMALS}f} "
            f"times {floor} from {cell.from_s:.{DECIMALS}f} to {cell.to_s:.{DECIMALS}f} s of {Path(cell.flight).name}"
            f"{follows}")


def nearest_in_words(diagnosis: Diagnosis) -> list[str]:
    """Why each of the nearest effects was not named, of those that the ranking does not show with a reason."""
    if not diagnosis.unexplained:
        return []
    shown = {r.name for r in leading(diagnosis.ranking) if r.why}
    near = [r for r in diagnosis.unexplained[0].nearest if r.name not in shown]
    return [f"{name_in_words(r.name)}: {r.why}" for r in near]


def leading(ranking: Sequence[RankedCandidate]) -> list[RankedCandidate]:
    """The candidates that are shown: the first MOST_RANKED, and `none` and `unknown` wherever they are."""
    return [r for i, r in enumerate(ranking) if i < MOST_RANKED or r.name in ("none", "unknown")]


def data_of_shrink(diagnosis: Diagnosis) -> str:
    """On what data the shrink of a candidate is measured: of a passing effect, which has no halves, on all."""
    if diagnosis.judged_on == FITTED and not any(e.seconds for e in diagnosis.effects):
        return "data that it is fitted to"
    return "data held out (of a passing effect: on those that it is fitted to)"
