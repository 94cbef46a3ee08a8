"""The report on a gap: a self-contained HTML page that renders a diagnosis or a measurement and computes nothing."""

from collections.abc import Callable, Sequence
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2

from airtouch import __version__
from airtouch.extras import lacking
from airtouch.gap.answer import words
from airtouch.gap.answer.advice import ADD_AN_EFFECT
from airtouch.gap.answer.pictures import Pictures
from airtouch.gap.measurement import Measurement
from airtouch.gap.result import Cell, Diagnosis
from airtouch.gap.second_process import map_on_two_cores
from airtouch.gap.where import summary
from airtouch.logs.files import write_bytes
from airtouch.report import gap_tables
from airtouch.report.write import embed

NO_PICTURES = "Pictures are left out, because matplotlib is not installed: pip install 'airtouch[plots]'"
ANCHOR = "add-an-effect"  #: anchor of the page's section on adding an effect


def write_measurement(path: Path, measurement: Measurement, pictures: Pictures | None = None, *, command: str,
                      force: bool = False) -> None:
    """Write the page of `airtouch gap measure`: map, largest cells, signals and spectra.

    Raises AirTouchError for a file that exists, without `force`.
    """
    headline = measurement.where[0] if measurement.where else None
    page = _page(
        title="Gap between flights and simulator", headline=headline,
        answers=(words.measured_in_words(headline), words.overall_in_words(measurement.gap)),
        cells=measurement.map.cells, floor_from=measurement.map.floor_from, where=measurement.where, pictures=pictures,
        calibration=gap_tables.parameter_rows(measurement.calibration),
        lists=[("Rotor speeds in the air", [words.rotor_in_words(r) for r in measurement.rotors]),
               ("What these logs cannot say", measurement.cannot), ("Notes", _notes(measurement.notes, pictures)),
               ("Left out", measurement.left_out)],
        flights=_flights(measurement.flights, measurement.vehicle, measurement.baseline), command=command)
    write_bytes(page.encode(), path, force)


def write_diagnosis(path: Path, diagnosis: Diagnosis, *, command: str, force: bool = False) -> None:
    """Write the page of `airtouch gap diagnose`: the answer in three sentences, the next steps, then the evidence.

    Raises AirTouchError for a file that exists, without `force`.
    """
    cells = diagnosis.map.cells if diagnosis.map else diagnosis.where
    left = summary.remaining(cells)
    page = _page(
        title="Gap between flights and simulator: diagnosis", answers=words.sentences(diagnosis),
        headline=diagnosis.headline, cells=cells, floor_from=diagnosis.map.floor_from if diagnosis.map else "",
        where=diagnosis.where, steps=diagnosis.next, anchor=ANCHOR, effects=gap_tables.effect_rows(diagnosis),
        ranking=gap_tables.ranking_rows(diagnosis),
        indistinguishable=[f"These logs cannot tell {words.joined(list(g))} apart."
                           for g in diagnosis.indistinguishable],
        pictures=diagnosis.pictures, how_far=gap_tables.how_far(diagnosis) if diagnosis.effects else None,
        phase_figures=gap_tables.phase_rows(summary.phases(cells)) if diagnosis.effects else [],
        remaining=words.remaining_in_words(left[:gap_tables.MOST_LEFT]), remaining_count=len(left),
        unexplained=words.all_open_in_words(diagnosis.unexplained), nearest=words.nearest_in_words(diagnosis),
        calibration=gap_tables.parameter_rows(diagnosis.calibration),
        lists=[("What these logs cannot say", diagnosis.cannot),
               ("Notes", _notes(diagnosis.notes, diagnosis.pictures))],
        flights=_flights(diagnosis.flights, diagnosis.vehicle, diagnosis.baseline), command=command)
    write_bytes(page.encode(), path, force)


def _page(*, cells: Sequence[Cell], headline: Cell | None, where: Sequence[Cell], pictures: Pictures | None,
          **context: Any) -> str:
    """The HTML of a page: what diagnosis and measurement share, and `context`; what it lacks is left out."""
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, undefined=jinja2.StrictUndefined)
    template = environment.from_string((resources.files("airtouch.report") / "gap.html").read_text("utf-8"))
    absent = {"effects": [], "ranking": [], "indistinguishable": [], "how_far": None, "phase_figures": [],
              "remaining": [], "remaining_count": 0, "unexplained": [], "nearest": [], "steps": (), "calibration": [],
              "anchor": ANCHOR}
    own = any(s.page == ADD_AN_EFFECT for s in context.get("steps", ()))
    return template.render({
        **absent, **context, "phases": gap_tables.maps(cells, headline), "bands": gap_tables.bands(cells),
        "legend": gap_tables.LEGEND, "has_headline": headline is not None,
        "where": gap_tables.largest_rows(where, headline), "images": _images(pictures),
        "example": example_effect() if own else "",
        "has_after": any(c.after is not None for c in cells), "version": __version__})


def example_effect() -> str:
    """The text of the example effect file."""
    return (resources.files("airtouch.simulation.effects") / "own_effect.py.txt").read_text("utf-8")


def _notes(notes: Sequence[str], pictures: Pictures | None) -> list[str]:
    """The notes, and one more if pictures cannot be drawn for want of matplotlib."""
    return [*notes, *([NO_PICTURES] if pictures is not None and lacking("plots") else [])]


def _images(pictures: Pictures | None) -> list[dict[str, str]]:
    """Plots of the headline's signal, of the gap's spectra and of the commands' spectra, as data URLs with text."""
    if pictures is None or lacking("plots"):
        return []
    from airtouch.report import gap_figures

    drawn: list[tuple[str, str, Callable[[], bytes]]] = []
    if pictures.signal is not None:
        one = pictures.signal
        name = gap_tables.capital(gap_tables.CHANNEL_WORDS[one.channel])
        drawn.append((f"{name}, up to {one.band_hz[1]:g} Hz",
                      f"Flight {Path(one.flight).name}. Grey: the floor; blue: take-off and landing; "
                      "yellow: over a platform.", partial(gap_figures.signals, one)))
    if pictures.spectra:
        drawn.append(("Spectra of the gap in the air", "Mean over all blocks." + (
            " A random effect cannot be predicted sample by sample: its green curve is what is "
            "left of the power." if any(s.after is not None for s in pictures.spectra) else ""),
            partial(gap_figures.spectra, pictures.frequency_hz, pictures.spectra)))
    if pictures.commands is not None:
        drawn.append(("Spectra of the motor commands",
                      "Delays, gains and noise in the loop show here, as a shape that differs.",
                      partial(gap_figures.commands, pictures.commands)))
    files = map_on_two_cores(lambda one: one[2](), drawn)
    return [{"title": title, "data": embed(file), "text": text}
            for (title, text, _), file in zip(drawn, files, strict=True)]


def _flights(names: Sequence[str], vehicle: str, baseline: Sequence[str]) -> str:
    return (f"Flights: {_few(names)}. Vehicle: {vehicle}. "
            + (f"Baseline: {_few(baseline)}." if baseline else "No baseline flights were given."))


def _few(names: Sequence[str]) -> str:
    shown = ", ".join(Path(n).name for n in names[:5])
    return shown + (f" and {len(names) - 5} more" if len(names) > 5 else "")
