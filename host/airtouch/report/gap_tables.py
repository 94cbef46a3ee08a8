"""Rows of the gap report's tables, ready for the page."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from airtouch.gap.band_sums import BANDS_HZ
from airtouch.gap.channels import CHANNELS
from airtouch.gap.gap_map import CHANNEL_WORDS, PHASE_WORDS, GapMap, in_words, ratio, short, significant
from airtouch.gap.result import Cell, Diagnosis, Quantity
from airtouch.gap.words import quantity
from airtouch.logs.segments import KINDS

#: least ratio to the floor, background, ink
SHADES = ((20.0, "#7f1d1d", "#ffffff"), (10.0, "#b3261e", "#ffffff"), (5.0, "#dd6b4d", "#ffffff"),
          (2.5, "#f2a27f", "#1f2328"), (1.5, "#f9cdb5", "#1f2328"), (0.0, "#fde9df", "#1f2328"))
QUIET = ("#f3f4f6", "#8a8f98")
LEGEND = [(*QUIET, "floor"), *((colour, ink, f"> {least:g}×" if least else "< 1.5×")
                               for least, colour, ink in reversed(SHADES))]
MOST_RANKED = 10


def maps(made: GapMap) -> list[dict[str, Any]]:
    """One table for each phase: channels down, bands across."""
    cells = {(c.phase, c.channel, c.band_hz): c for c in made.cells if c.regime == "all"}
    out = []
    for kind in KINDS:
        rows = []
        for channel in CHANNELS:
            some = [cells.get((kind, channel.name, band)) for band in BANDS_HZ]
            if any(some):
                rows.append({"name": CHANNEL_WORDS[channel.name], "cells": [c and shaded(c) for c in some]})
        if rows:
            words = PHASE_WORDS[kind]
            out.append({"name": words[0].upper() + words[1:], "rows": rows})
    return out


def shaded(cell: Cell) -> dict[str, str]:
    """A cell of the heat map: text, colours, and a title with its figures."""
    times = ratio(cell)
    sure = significant(cell)
    colour, ink = next((c, i) for least, c, i in SHADES if times >= least) if sure else QUIET
    title = (f"{in_words(cell)}; interval {short(cell.low)} to {short(cell.high)}, "
             f"floor {short(cell.floor)} {cell.unit}, "
             f"{cell.blocks} blocks of {cell.flights} flights")
    after = "" if cell.after is None or not sure else f"{short(cell.after / max(cell.floor, 1e-12))}×"
    return {"text": f"{times:.0f}×" if times >= 9.95 else f"{times:.1f}×", "colour": colour, "ink": ink,
            "title": title, "after": after}


def largest_rows(cells: Iterable[Cell]) -> list[dict[str, str]]:
    """The largest cells in figures."""
    return [{"words": in_words(c).split(":")[0], "gap": f"{short(c.gap)}",
             "interval": "" if c.low is None else f"{short(c.low)} to {short(c.high)}",
             "after": "-" if c.after is None else f"{short(c.after)}", "floor": f"{short(c.floor)}",
             "unit": c.unit + (f"; {c.by}" if c.by else ""),
             "ratio": short(ratio(c))} for c in cells]


def effect_rows(diagnosis: Diagnosis) -> list[dict[str, str]]:
    """The parameters of the effects named."""
    return [{"effect": e.name if i == 0 else "", "parameter": k, "value": f"{q.value:.3g}",
             "interval": "" if q.low is None or q.high is None else f"{q.low:.3g} to {q.high:.3g}",
             "unit": "" if q.unit == "1" else q.unit}
            for e in diagnosis.effects for i, (k, q) in enumerate(e.parameters.items())]


def ranking_rows(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """The best candidates, and `none` and `unknown` wherever they are."""
    shown = [r for i, r in enumerate(diagnosis.ranking) if i < MOST_RANKED or r.name in ("none", "unknown")]
    return [{"name": r.name, "probability": f"{r.probability:.1%}", "width": round(100 * r.probability),
             "shrink": f"{r.shrink.value:.2f}",
             "interval": "" if r.shrink.low is None or r.shrink.high is None
             else f"{r.shrink.low:.2f} to {r.shrink.high:.2f}"} for r in shown]


def how_far(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """Gap before, after and floor, in both arms and with the wrong effect."""
    keys = ("before", "after", "floor", "shrink")
    sources: list[tuple[str, Mapping[str, Any]]] = []
    if diagnosis.gap:
        named = ", ".join(e.name for e in diagnosis.effects) or "no effect"
        sources.append((named, {**diagnosis.gap, "shrink": diagnosis.shrink}))
    if diagnosis.control:
        sources.append((f"wrong effect: {diagnosis.control.get('name', 'control')}", diagnosis.control))
    sources += [(f"vehicle {name}", arm) for name, arm in diagnosis.arms.items() if isinstance(arm, Mapping)]
    rows = [{"name": name, "cells": [figure(some.get(k)) for k in keys]} for name, some in sources]
    rows = [r for r in rows if any(v != "-" for v in r["cells"])]
    return {"columns": keys, "rows": rows} if rows else None


def figure(value: Any) -> str:
    """A number, a quantity or its JSON form; `-` for none."""
    if isinstance(value, Mapping) and "value" in value:
        value = Quantity(**{k: v for k, v in value.items() if k in ("value", "low", "high", "unit")})
    if isinstance(value, Quantity):
        return quantity(value, "{:.2f}")
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return f"{value:.3g}"
    return "-"


def named(parameters: Mapping[str, Quantity]) -> list[tuple[str, str]]:
    """Calibrated parameters with their intervals."""
    return [(k, quantity(q)) for k, q in parameters.items()]


def shown_channels(cells: Sequence[Cell], most: int = 3) -> list[str]:
    """The channels of the largest cells, each once."""
    return list(dict.fromkeys(c.channel for c in cells))[:most]
