"""Rows of the gap report's tables, ready for the page: texts, colours, what is folded and what is marked.

What stands out from its floor, what stays, and the order of phases `gap.where.summary` decides; here its answers are
asked for and written out.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from airtouch.gap.answer.words import SHRINK_FORM, format_of, leading, printed_value, seconds_in_words
from airtouch.gap.result import Diagnosis, Quantity
from airtouch.gap.signals.channels import CHANNEL_WORDS, CHANNELS
from airtouch.gap.where import summary
from airtouch.gap.where.cell import Cell
from airtouch.gap.where.cell_words import PHASE_WORDS, gap, in_words, interval, place_in_words, short
from airtouch.report.columns import WithInterval


class Shade(NamedTuple):
    """Colours of a cell from a least ratio of gap to floor on."""

    least: float
    background: str
    ink: str


#: shades of cells that stand out from their floor, the largest ratio first; chosen
SHADES = (Shade(20.0, "#7f1d1d", "#ffffff"), Shade(10.0, "#b3261e", "#ffffff"), Shade(5.0, "#dd6b4d", "#ffffff"),
          Shade(2.5, "#f2a27f", "#1f2328"), Shade(1.5, "#f9cdb5", "#1f2328"), Shade(0.0, "#fde9df", "#1f2328"))
AT_FLOOR = Shade(0.0, "#f3f4f6", "#8a8f98")  #: of the other cells
#: (background colour, text colour, text) of each shade
LEGEND = [(AT_FLOOR.background, AT_FLOOR.ink, "floor"),
          *((s.background, s.ink, f"> {s.least:g}×" if s.least else "< 1.5×") for s in reversed(SHADES))]
#: cells that stay over the floor, as many as the page names in words, and as many more that concern the answer; chosen
MOST_REMAINING = 10


def bands(cells: Iterable[Cell]) -> list[tuple[float, float]]:
    """The frequency bands of the map, Hz, lowest first."""
    return sorted({c.band_hz for c in cells})


def maps(cells: Sequence[Cell], headline: Cell | None = None) -> list[dict[str, Any]]:
    """The heat map of each phase, that with the most energy first: its name, rows and text, and whether it is open.

    Rows are channels, columns are bands. The headline's phase is open, and the first where any cell stands out; the
    others are folded.
    """
    return [{"name": capital(PHASE_WORDS[phase.name]), "rows": _map_rows(cells, phase.name, headline),
             "open": (place == 0 and phase.over > 0) or (headline is not None and phase.name == headline.phase),
             "text": _phase_text(phase)} for place, phase in enumerate(summary.phases(cells))]


def _map_rows(cells: Sequence[Cell], phase: str, headline: Cell | None) -> list[dict[str, Any]]:
    """Rows of the heat map of a phase: the channel's name, and a cell for each band, None where there is none."""
    place = {(c.channel, c.band_hz): c for c in cells if c.regime == "all" and c.phase == phase}
    of_headline = (headline.channel, headline.band_hz) if headline and headline.phase == phase else None
    rows = []
    for channel in CHANNELS:
        keys = [(channel.name, band) for band in bands(cells)]
        if any(key in place for key in keys):
            rows.append({"name": CHANNEL_WORDS[channel.name], "cells": [
                heat_map_cell(place[key], headline=key == of_headline) if key in place else None
                for key in keys]})
    return rows


def _phase_text(phase: summary.Phase) -> str:
    """How many cells of a phase stand out, without and with the named effects, in words."""
    text = f"{phase.over} of {phase.cells} cells over the floor"
    if phase.after is None:
        return text
    worse = f", {phase.worse} worse than before" if phase.worse else ""
    return f"{text}, {phase.stay} with the effects in the model{worse}"


def phase_rows(phases: Sequence[summary.Phase]) -> list[dict[str, Any]]:
    """A row for each phase: the gap before and after the named effects over the floor, and counts of cells."""
    return [{"name": capital(PHASE_WORDS[p.name]), "before": short(p.before),
             "after": "-" if p.after is None else short(p.after), "over": p.over, "stay": p.stay, "worse": p.worse}
            for p in phases]


def capital(text: str) -> str:
    """The text with a capital first letter."""
    return text[:1].upper() + text[1:]


def heat_map_cell(cell: Cell, headline: bool = False) -> dict[str, Any]:
    """A cell of the heat map: text, colours, and a title with gap, interval if there is one, floor and sample size.

    headline: whether it is the one of the answer; after: the ratio with the named effects in the model, where the cell
    is that or stands out without or with them, else ""; worse: whether it got worse with them.
    """
    times, stands_out = cell.ratio, summary.stands_out(cell)
    shade = next(s for s in SHADES if times >= s.least) if stands_out else AT_FLOOR
    flights = f"{cell.flights} flight{'s' * (cell.flights != 1)}"
    title = "; ".join([in_words(cell), ", ".join(filter(None, [
        f"interval {interval(cell)}" if interval(cell) else "", f"floor {short(cell.floor)} {cell.unit}",
        f"{cell.blocks} blocks of {flights}" if cell.blocks else flights]))])
    has_after = cell.after is not None and (headline or stands_out or summary.stays(cell))
    return {"text": _times(times), "colour": shade.background, "ink": shade.ink, "title": title,
            "after": _times(cell.ratio_after) if has_after else "", "worse": summary.got_worse(cell),
            "headline": headline}


def _times(ratio: float) -> str:
    """A ratio of gap to floor as the heat map has it."""
    return f"{ratio:.0f}×" if ratio >= 9.95 else f"{ratio:.1f}×"


def largest_rows(cells: Iterable[Cell], headline: Cell | None = None) -> list[dict[str, Any]]:
    """Rows of the largest cells, in their units, with the effect that takes most from each beside its unit."""
    return [{"words": place_in_words(c), "headline": c is headline or c == headline, "gap": gap(c),
             "interval": interval(c), "after": "-" if c.after is None else short(c.after), "floor": short(c.floor),
             "unit": c.unit + (f"; caused by {c.by}" if c.by else ""), "ratio": short(c.ratio)} for c in cells]


def order_of_largest(cells: Sequence[Cell], headline: Cell | None = None) -> str:
    """Which row of the largest cells is marked, whether it stands out, and in what order the others follow."""
    parts = []
    if headline is not None:
        inside = "" if summary.stands_out(headline) else ", which does not stand out from its floor"
        parts.append(f"The blue row is the cell of the answer{inside}.")
    if any(c.low is not None for c in cells):
        parts.append(f"The {'others' if parts else 'cells'} stand out, the surest first: by the lower end of the gap's "
                     "interval over the upper end of the floor's.")
    return " ".join(parts)


def remaining_to_name(remaining: Sequence[Cell], headline: Cell | None) -> list[Cell]:
    """Of the cells that stay over the floor, largest first: the first, then those others that concern the answer.

    The latter are the cells that got worse with the named effects, and those of the headline's channel.
    """
    of_answer = [c for c in remaining[MOST_REMAINING:]
                 if summary.got_worse(c) or (headline is not None and c.channel == headline.channel)]
    return [*remaining[:MOST_REMAINING], *of_answer[:MOST_REMAINING]]


def effect_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """A row for each parameter of the named effects; the first of an effect has its name and its seconds."""
    rows = []
    for effect in diagnosis.effects:
        name, seconds = effect.name, seconds_in_words(effect)
        for parameter, q in effect.parameters.items():
            form = format_of(q)
            rows.append({"effect": name, "parameter": parameter, "value": form.format(printed_value(q)),
                         "interval": _interval(q, form), "unit": "" if q.unit == "1" else q.unit,
                         "seconds": f"acts {seconds}" if seconds else ""})
            name = seconds = ""
    return rows


def _interval(q: Quantity, form: str) -> str:
    """The interval of a quantity, "" where there is none. form: format of a number, as `{:.2f}`."""
    return "" if q.low is None or q.high is None else f"{form.format(q.low)} to {form.format(q.high)}"


def ranking_rows(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Rows of the leading candidates, and of `none` and `unknown` at any rank."""
    return [{"name": r.name, "probability": f"{r.probability:.1%}", "width": round(100 * r.probability),
             "shrink": SHRINK_FORM.format(r.shrink.value) if r.measured else "-", "why": r.why,
             "interval": _interval(r.shrink, SHRINK_FORM)}
            for r in leading(diagnosis.ranking)]


HOW_FAR_COLUMNS = ("before", "after", "floor", "shrink")  #: of the table of how far the gap closes
#: why the arm with the vehicle as declared has another gap before
OTHER_START = ("without the calibration on the baseline flights, so model, floor and the gap before are others than "
               "above")


def how_far_rows(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Rows of how far the gap closes: the model, its figures, and why it starts from another gap, or ""."""
    return [{"name": arm.model, "why": OTHER_START if arm.own_start else "",
             "cells": [_number(arm.before), _number(arm.after), _number(arm.floor), _shrink(arm.shrink)]}
            for arm in diagnosis.how_far]


def _number(value: float | None) -> WithInterval:
    """A number to three digits; "-" for None."""
    return WithInterval("-" if value is None else f"{value:.3g}")


def _shrink(shrink: Quantity | None) -> WithInterval:
    """A shrink with its interval; "-" for None."""
    return WithInterval("-") if shrink is None else with_interval(shrink, SHRINK_FORM)


def with_interval(q: Quantity, form: str) -> WithInterval:
    """A quantity with its unit, and its interval. form: format of a number, as `{:.2f}`."""
    unit = "" if q.unit in ("1", "") else f" {q.unit}"
    return WithInterval(form.format(printed_value(q)) + unit, _interval(q, form))


def parameter_rows(parameters: Mapping[str, Quantity]) -> list[tuple[str, WithInterval]]:
    """(name, value with interval) of calibrated parameters."""
    return [(name, with_interval(q, format_of(q))) for name, q in parameters.items()]
