"""The page of `airtouch twin`: recorded and simulated flights side by side."""

from pathlib import Path
from typing import NamedTuple

from airtouch import __version__
from airtouch.logs.files import write_bytes
from airtouch.report import twin_figures
from airtouch.report.html_page import embedded, rendered
from airtouch.twin.comparison.compare import Comparison
from airtouch.twin.comparison.curves import Curves
from airtouch.twin.comparison.words import answer, gap_row
from airtouch.twin.fitting.calibrate import Calibration
from airtouch.twin.recorded.flights import RecordedFlights

MOST_GAPS = 30  #: gaps that the page lists, largest first; no source: about one screen


class FlownTwin(NamedTuple):
    """A twin as the page shows it: the flights that it was fitted to, the fit, and how its own flights compare."""

    recorded: RecordedFlights
    fit: Calibration
    comparison: Comparison
    curves: Curves


def write_report(path: Path, twin: FlownTwin, *, command: str, force: bool = False) -> None:
    """Write the page as a self-contained HTML file; raises AirTouchError for a file that exists, without `force`."""
    recorded, fit, comparison, curves = twin
    misfit_before = fit.history[0]["misfit"]
    images = [("One flight and its twin", "", twin_figures.overlaid(curves.overlaid)),
              ("Spectra in free air", "", twin_figures.spectra(curves.spectra)),
              *(("Around the edges, medians and quartiles", twin_figures.class_in_words(name),
                 twin_figures.edges(kinds)) for name, kinds in curves.edges.items())]
    page = rendered(
        "twin.html", answer=answer(comparison.auroc), auroc=comparison.auroc,
        misfit=[(g, misfit_before.get(g), v) for g, v in comparison.misfit.items()],
        gaps=[gap_row(g) for g in comparison.gaps[:MOST_GAPS]],
        levers=[(lever.name, f"{value:.4g}", f"{lever.start:.4g}", lever.unit)
                for lever, value in zip(fit.levers, fit.values, strict=True)],
        images=[(title, text, embedded(figure)) for title, text, figure in images],
        flights=len(recorded.courses), simulated=len(comparison.flights), lost=comparison.diverged,
        left_out=recorded.left_out,
        speeds=sorted({c.speed_from for c in recorded.courses}), command=command, version=__version__)
    write_bytes(page.encode(), path, force)
