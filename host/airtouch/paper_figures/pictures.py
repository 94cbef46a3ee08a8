"""Plots that several figures share, each drawn on a matplotlib axes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.evaluation.score_report import hit_curve
from airtouch.report.evaluation_figures import COLOURS
from airtouch.report.style import GREY, PlotFigure, image, style

PAPER = "#444444"  #: colour of the paper's figures in every plot
WIDTH_IN, HEIGHT_IN = 6.4, 3.8


def render(draw: Any) -> tuple[bytes, bytes]:
    """(PNG, SVG) of a figure that `draw` fills."""
    with style({"figure.dpi": 130}):
        canvas = PlotFigure(figsize=(WIDTH_IN, HEIGHT_IN), layout="constrained")
        draw(canvas)
        return image(canvas), image(canvas, "svg")


def colour(name: str) -> str:
    """A detector's colour."""
    return COLOURS.get(name.split(",")[0], GREY)


def signed_errors(axes: Any, errors: Mapping[str, Sequence[float | None]], paper_m: float) -> None:
    """Draw errors edge by edge, m, positive early, None for a missed edge; the band is the paper's mean error."""
    axes.axhspan(-paper_m, paper_m, color=PAPER, alpha=0.15, lw=0, label=f"paper: mean |error| {paper_m:.4g} m")
    for row, (name, values) in enumerate(errors.items()):
        edges = np.arange(1, len(values) + 1)
        missed = np.array([v is None for v in values], bool)
        axes.plot(edges, [np.nan if v is None else v for v in values], ".", ms=4, color=colour(name), alpha=0.8,
                  label=name)
        axes.plot(edges[missed], np.full(missed.sum(), -0.50 - 0.04 * row), "|", ms=5, color=colour(name))
    axes.axhline(0.0, color=GREY, lw=0.6)
    axes.set(xlabel="edge (ticks below: missed)", ylabel="error, m (positive: early)", ylim=(-0.6, 0.55))
    axes.legend(fontsize=7, frameon=False, ncols=len(errors) + 1, loc="upper left")


def hit_curves(axes: Any, scores: Mapping[str, Sequence[FlightScore]], styles: Mapping[str, Any] | None = None,
               legend: bool = True) -> None:
    """Draw the hit curve of each group of flights, name -> its scores. styles: name -> keywords of its line."""
    for name, group in scores.items():
        curve = hit_curve(group)
        if curve.edges:
            axes.step(curve.distance_m, curve.share, where="post", label=f"{name} ({curve.edges})",
                      **((styles or {}).get(name, {})))
    axes.set(xlim=(0, 0.4), ylim=(0, 1), xlabel="distance error, m", ylabel="fraction of true edges")
    axes.grid(alpha=0.25)
    if legend:
        axes.legend(fontsize=7, frameon=False, loc="lower right")


def logarithmic(axes: Any, places: Sequence[float], label: str) -> None:
    """A logarithmic axis in x with a tick, in plain numbers, at each place."""
    axes.set(xscale="log", xlabel=label)
    axes.set_xticks(places, [f"{place:,.10g}" for place in places], minor=False)
    axes.minorticks_off()


def curve(axes: Any, places: Sequence[float], rows: Sequence[Mapping[str, Any]], key: str, factor: float, colour: str,
          label: str | None = None) -> None:
    """Draw a figure of summaries with its 95 % interval at each place; no point if no edge was detected."""
    axes.plot(places, [np.nan if r[key] is None else factor * r[key] for r in rows], "o-", ms=4, color=colour,
              label=label)
    for place, row in zip(places, rows, strict=True):
        if row["intervals"][key]:
            axes.plot([place, place], [factor * b for b in row["intervals"][key]], color=colour, lw=0.8)


def bars(axes: Any, rows: Sequence[Mapping[str, Any]], value: str, low: str, high: str, label: str,
         colours: Sequence[str] | None = None, factor: float = 1.0) -> None:
    """Draw a bar with its 95 % interval for each row."""
    for i, row in enumerate(rows):
        if row[value] is None:
            axes.text(i, 0.0, "none found", ha="center", va="bottom", fontsize=7)
            continue
        axes.bar(i, factor * row[value], color=colours[i] if colours else colour(str(row["what"])), width=0.7)
        if row[low] is not None:
            axes.plot([i, i], [factor * row[low], factor * row[high]], color="black", lw=1)
    axes.set_xticks(range(len(rows)), [str(r["what"]) for r in rows], fontsize=7,
                    rotation=20 if len(rows) > 4 else 0, ha="right" if len(rows) > 4 else "center")
    axes.set_ylabel(label)


def paper_stars(axes: Any, values: Mapping[int, float]) -> None:
    """Draw stars at the paper's values, place on the axis -> value."""
    axes.plot(list(values), list(values.values()), "*", color="black", ms=9, ls="none", label="in the paper")
    axes.legend(fontsize=7, frameon=False, loc="upper left")
