"""Rows of the gap report's tables, ready for the page."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from airtouch.gap.answer.words import digits, leading, quantity, seconds_in_words
from airtouch.gap.result import Cell, Diagnosis, Quantity
from airtouch.gap.signals.channels import CHANNEL_WORDS, CHANNELS
from airtouch.gap.where import summary
from airtouch.gap.where.cell_words import PHASE_WORDS, in_words, interval, ratio, short

#: (least ratio of gap to floor, background colour, text colour)
SHADES = ((20.0, "#7f1d1d", "#ffffff"), (10.0, "#b3261e", "#ffffff"), (5.0, "#dd6b4d", "#ffffff"),
          (2.5, "#f2a27f", "#1f2328"), (1.5, "#f9cdb5", "#1f2328"), (0.0, "#fde9df", "#1f2328"))
QUIET = ("#f3f4f6", "#8a8f98")
LEGEND = [(*QUIET, "floor"), *((colour, ink, f"> {least:g}×" if least else "< 1.5×")
                               for least, colour, ink in reversed(SHADES))]
MOST_LEFT = 10  #: remaining cells that the page names in words


def bands(cells: Iterable[Cell]) -> list[tuple[float, float]]:
    """The frequency bands of the map, Hz, lowest first."""
    return sorted({c.band_hz for c in cells})


def maps(cells: Sequence[Cell], headline: Cell | None = None) -> list[dict[str, Any]]:
    """One table for each phase, that with the most energy first. Rows are channels, columns are bands.

    The headline's phase is open, and the first where any cell stands out; the others are folded.
    """
    place = {(c.phase, c.channel, c.band_hz): c for c in cells if c.regime == "all"}
    marked = (headline.phase, headline.channel, headline.band_hz) if headline else None
    out = []
    for n, phase in enumerate(summary.phases(cells)):
        rows = []
        for channel in CHANNELS:
            some = [place.get((phase.name, channel.name, band)) for band in bands(cells)]
            if any(some):
                rows.append({"name": CHANNEL_WORDS[channel.name], "cells": [_map_cell(c, marked) for c in some]})
        shown = (n == 0 and phase.over > 0) or (headline is not None and phase.name == headline.phase)
        worse = f", {phase.worse} worse than before" if phase.worse else ""
        out.append({"name": capital(PHASE_WORDS[phase.name]), "rows": rows, "open": shown,
                    "text": f"{phase.over} of {phase.cells} cells over the floor"
                            + ("" if phase.after is None else f", {phase.stay} with the effects in the model{worse}")})
    return out


def _map_cell(cell: Cell | None, marked: tuple[str, str, tuple[float, float]] | None) -> dict[str, Any] | None:
    """A cell of the heat map with whether it is the headline's, at `marked`; None for no cell."""
    if cell is None:
        return None
    return {**heat_map_cell(cell), "headline": (cell.phase, cell.channel, cell.band_hz) == marked}


def phase_rows(phases: Sequence[summary.Phase]) -> list[dict[str, Any]]:
    """Rows of the gap before and after the named effects, one for each phase."""
    return [{"name": capital(PHASE_WORDS[p.name]), "before": short(p.before),
             "after": "-" if p.after is None else short(p.after), "over": p.over, "stay": p.stay, "worse": p.worse}
            for p in phases]


def capital(text: str) -> str:
    """The text with a capital first letter."""
    return text[:1].upper() + text[1:]


def heat_map_cell(cell: Cell) -> dict[str, str]:
    """A cell of the heat map: text, colours, and a title with gap, interval, floor and sample size."""
    times = ratio(cell)
    sure = summary.significant(cell)
    colour, ink = next((c, i) for least, c, i in SHADES if times >= least) if sure else QUIET
    title = (f"{in_words(cell)}; interval {interval(cell) or 'not known'}, "
             f"floor {short(cell.floor)} {cell.unit}, "
             f"{cell.blocks} blocks of {cell.flights} flights")
    after = "" if cell.after is None or not sure else f"{short(cell.after / max(cell.floor, 1e-12))}×"
    return {"text": f"{times:.0f}×" if times >= 9.95 else f"{times:.1f}×", "colour": colour, "ink": ink,
            "title": title, "after": after}


def largest_rows(cells: Iterable[Cell], headline: Cell | None = None) -> list[dict[str, Any]]:
    """Rows of the largest cells."""
    return [{"words": in_words(c).split(":")[0], "headline": c is headline or c == headline, "gap": f"{short(c.gap)}",
             "interval": interval(c),
             "after": "-" if c.after is None else f"{short(c.after)}", "floor": f"{short(c.floor)}",
             "unit": c.unit + (f"; caused by {c.by}" if c.by else ""),
             "ratio": short(ratio(c))} for c in cells]


def effect_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """Rows of the parameters of the named effects."""
    return [{"effect": e.name if i == 0 else "", "parameter": k, "value": (form := digits(q)).format(q.value),
             "interval": "" if q.low is None or q.high is None else f"{form.format(q.low)} to {form.format(q.high)}",
             "unit": "" if q.unit == "1" else q.unit,
             "seconds": "acts " + seconds if i == 0 and (seconds := seconds_in_words(e))
             else ""}
            for e in diagnosis.effects for i, (k, q) in enumerate(e.parameters.items())]


def ranking_rows(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Rows of the leading candidates, and of `none` and `unknown` at any rank."""
    return [{"name": r.name, "probability": f"{r.probability:.1%}", "width": round(100 * r.probability),
             "shrink": f"{r.shrink.value:.2f}", "why": r.why,
             "interval": "" if r.shrink.low is None or r.shrink.high is None
             else f"{r.shrink.low:.2f} to {r.shrink.high:.2f}"} for r in leading(diagnosis.ranking)]


#: why the arm with the vehicle as declared has another gap before
OTHER_START = ("without the calibration on the baseline flights, so model, floor and the gap before are others than "
               "above")


def how_far(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """Table of the gap before and after, the floor and the shrink: right effect, wrong effect, and both arms.

    `why` of a row says why its gap before differs from the first row's, or is empty. None without figures.
    """
    keys = ("before", "after", "floor", "shrink")
    sources: list[tuple[str, Mapping[str, Any]]] = []
    named = ", ".join(e.name for e in diagnosis.effects) or "no effect"
    if diagnosis.gap:
        sources.append((named, {**diagnosis.gap, "shrink": diagnosis.shrink}))
    if diagnosis.control is not None:
        sources.append((f"wrong effect: {diagnosis.control.name}", diagnosis.control.plain()))
    sources += [(f"{named}, vehicle as {name}", arm.plain()) for name, arm in diagnosis.arms.items()
                if arm.share != diagnosis.shrink]
    starts = [figure(some.get("before")) for _, some in sources]
    rows = [{"name": name, "cells": [figure(some.get(k)) for k in keys],
             "why": OTHER_START if start not in ("-", starts[0]) else ""}
            for (name, some), start in zip(sources, starts, strict=True)]
    rows = [r for r in rows if any(v != "-" for v in r["cells"])]
    return {"columns": keys, "rows": rows} if rows else None


def figure(value: Any) -> str:
    """Text of a number, a quantity or a quantity's JSON form; "-" for anything else."""
    if isinstance(value, Mapping) and "value" in value:
        value = Quantity(**{k: v for k, v in value.items() if k in ("value", "low", "high", "unit")})
    if isinstance(value, Quantity):
        return quantity(value, "{:.2f}")
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return f"{value:.3g}"
    return "-"


def parameter_rows(parameters: Mapping[str, Quantity]) -> list[tuple[str, str]]:
    """(name, value with interval) of calibrated parameters."""
    return [(k, quantity(q)) for k, q in parameters.items()]
