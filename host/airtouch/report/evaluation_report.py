"""The report on scored flights: a self-contained HTML page with tables, plots and a few flights."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from airtouch import __version__
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.evaluation.score_report import ScoreReport
from airtouch.logs.files import write_bytes
from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.report.columns import COLUMNS, cell
from airtouch.report.html_page import embedded, rendered


def write_report(
    path: Path,
    title: str,
    scored: ScoreReport,
    *,
    parameters: Mapping[str, Any],
    command: str,
    left_out: Sequence[tuple[str, str]] = (),
    force: bool = False,
) -> None:
    """Write score table, plots and a few flights to a file.

    parameters, command: printed at the end of the page. left_out: (file, reason) of flights that were not scored.
    Raises AirTouchError for a file that exists, without `force`.
    """
    from airtouch.report import evaluation_figures as figures

    first = next(iter(scored.summaries))
    fewest_missed_first = sorted(scored.summaries.items(), key=lambda row: row[1]["missed_count"])
    page = rendered(
        "evaluation.html",
        title=title, answers=[answer(*row) for row in fewest_missed_first], summaries=scored.summaries,
        columns=COLUMNS, cell=cell, breakdowns=scored.breakdowns,
        errors=embedded(figures.error_distribution(scored.hits)),
        reliability=embedded(figures.reliability(scored.reliability)),
        flights=[{"name": f.score.file, "text": f"{first}: {in_words(f.score)}",
                  "image": embedded(figures.flight(f.log, f.trace, f.edges, f.others, first))} for f in scored.flights],
        parameters=parameters, command=command, version=__version__, left_out=left_out)
    write_bytes(page.encode(), path, force)


def answer(name: str, table: Mapping[str, Any]) -> str:
    """The result of a detector in one sentence. table: its summary."""
    if not table["edges"]:
        return (f"{name}: {table['detections']} edges detected on {table['flights']} flights; "
                "there is no true edge to compare with.")
    error = table["mean_abs_error_m"]
    errors = "none was detected" if error is None else f"the edges detected are {error:.3f} m off on average"
    return (f"{name} on {table['flights']} flights with {table['edges']} edges: "
            f"{table['missed_count']} missed ({table['missed']:.0%}), {table['false_count']} false "
            f"({table['false_per_minute']:.1f} a minute), {errors}.")


def in_words(score: FlightScore) -> str:
    """The result of one flight in one sentence."""
    parts = []
    for edge in score.edges:
        if edge.error_s is None:
            parts.append(f"{edge.kind} at {edge.true_sample / SAMPLE_RATE_HZ:.2f} s missed")
        else:
            metres = "" if edge.error_m is None else f" ({abs(edge.error_m):.3f} m)"
            side = "early" if edge.error_s > 0 else "late"
            parts.append(f"{edge.kind} at {edge.true_sample / SAMPLE_RATE_HZ:.2f} s detected "
                         f"{abs(edge.error_s):.2f} s {side}{metres}")
    false = score.note if score.false is None else f"{len(score.false)} false edges"
    return "; ".join([*parts, false]) + "."
