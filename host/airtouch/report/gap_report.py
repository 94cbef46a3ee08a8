"""The report on a gap: a self-contained HTML page that renders a diagnosis or a measurement.

Nothing is fitted, replayed or averaged here. The answer, its figures and its headline stand in the diagnosis; of the
map's cells `gap.where.summary` says which stay over the floor and sums them up by phase. The words are those of
`gap.answer` (`sentences`, `words`, `advice`), of the cells (`gap.where.cell_words`), of the channels
(`gap.signals.channels`) and of the measurement itself (`Measurement.sentences`). This module chooses how many of each
are shown, and lays them out.
"""

from collections.abc import Callable, Sequence
from functools import partial
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from airtouch import __version__
from airtouch.extras import lacking
from airtouch.gap.answer import words
from airtouch.gap.answer.advice import ADD_AN_EFFECT
from airtouch.gap.answer.curves import MOST_FLIGHTS, Curves
from airtouch.gap.answer.sentences import sentences
from airtouch.gap.measurement import Measurement
from airtouch.gap.result import Diagnosis
from airtouch.gap.second_process import map_on_two_cores
from airtouch.gap.signals.channels import CHANNEL_WORDS
from airtouch.gap.where import summary
from airtouch.gap.where.cell import Cell
from airtouch.gap.where.cell_words import place_in_words, remaining_in_words
from airtouch.logs.files import make_folder, write_bytes
from airtouch.logs.segments import KINDS
from airtouch.report import gap_tables
from airtouch.report.html_page import embedded, rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NO_PLOTS = "Pictures are left out, because matplotlib is not installed: pip install 'airtouch[plots]'"
ANCHOR = "add-an-effect"  #: anchor of the page's section on adding an effect
#: what the grey lines are in the plot of a signal
FLOOR_DRAWN = "Between the dark grey lines: the floor in this band (rms) in each phase."
BEFORE_AFTER = "Before and after: without and with the named effects in the model."
#: in the plot of a signal, by `style.limit`
AXIS_LIMITS = "An axis holds the middle 99 % of each curve; a triangle at its edge is where a curve leaves it."
PLOTS = ("signal", "spectra", "commands")  #: names of the page's plots, in its order
MOST_NAMED = 5  #: flights that the page names; chosen


def write_measurement(path: Path, measurement: Measurement, *, command: str, force: bool = False) -> None:
    """Write the page of `airtouch gap measure`: map, largest cells, signals and spectra.

    Raises AirTouchError for a file that exists, without `force`.
    """
    page = _page(
        title="Gap between flights and simulator", headline=measurement.headline,
        answers=measurement.sentences,
        cells=measurement.map.cells, floor_from=measurement.map.floor_from, where=measurement.where,
        curves=measurement.curves, calibration=gap_tables.parameter_rows(measurement.calibration),
        lists=[("Rotor speeds in the air", [r.in_words() for r in measurement.rotors]),
               ("What these logs cannot say", measurement.cannot),
               ("Notes", _notes(measurement.notes, measurement.curves)), ("Left out", measurement.left_out)],
        flights=_flights(measurement.flights, measurement.vehicle, measurement.baseline), command=command)
    write_bytes(page.encode(), path, force)


def write_diagnosis(path: Path, diagnosis: Diagnosis, *, command: str, force: bool = False) -> None:
    """Write the page of `airtouch gap diagnose`: the answer in three sentences, the next steps, then the evidence.

    Raises AirTouchError for a file that exists, without `force`.
    """
    cells = diagnosis.map.cells if diagnosis.map else diagnosis.where
    remaining = summary.remaining(cells)
    page = _page(
        title="Gap between flights and simulator: diagnosis", answers=sentences(diagnosis),
        headline=diagnosis.headline, cells=cells, floor_from=diagnosis.map.floor_from if diagnosis.map else "",
        where=diagnosis.where, steps=diagnosis.next, anchor=ANCHOR, effects=gap_tables.effect_rows(diagnosis),
        ranking=gap_tables.ranking_rows(diagnosis), data_of_shrink=words.data_of_shrink(diagnosis),
        indistinguishable=[f"These logs cannot tell {words.joined(list(g))} apart."
                           for g in diagnosis.indistinguishable],
        curves=diagnosis.curves, how_far=gap_tables.how_far_rows(diagnosis) if diagnosis.effects else [],
        phase_figures=gap_tables.phase_rows(summary.phases(cells)) if diagnosis.effects else [],
        remaining=remaining_in_words(gap_tables.remaining_to_name(remaining, diagnosis.headline)),
        remaining_count=len(remaining),
        unexplained=words.all_open_in_words(diagnosis.unexplained), nearest=words.nearest_in_words(diagnosis),
        calibration=gap_tables.parameter_rows(diagnosis.calibration),
        lists=[("What these logs cannot say", diagnosis.cannot),
               ("Notes", _notes(diagnosis.notes, diagnosis.curves))],
        flights=_flights(diagnosis.flights, diagnosis.vehicle, diagnosis.baseline), command=command)
    write_bytes(page.encode(), path, force)


def _page(*, cells: Sequence[Cell], headline: Cell | None, where: Sequence[Cell], curves: Curves | None,
          **context: Any) -> str:
    """The HTML of a page: what diagnosis and measurement share, and `context`, whose parts a page may lack."""
    absent = {"effects": [], "ranking": [], "indistinguishable": [], "how_far": [],
              "how_far_columns": gap_tables.HOW_FAR_COLUMNS, "phase_figures": [], "remaining": [], "remaining_count": 0,
              "unexplained": [], "nearest": [], "steps": (), "calibration": [], "anchor": ANCHOR}
    shows_how_to_add = any(s.page == ADD_AN_EFFECT for s in context.get("steps", ()))
    return rendered("gap.html", **{
        **absent, **context, "phases": gap_tables.maps(cells, headline), "bands": gap_tables.bands(cells),
        "legend": gap_tables.LEGEND, "has_headline": headline is not None,
        "where": gap_tables.largest_rows(where, headline), "where_note": gap_tables.order_of_largest(where, headline),
        "images": _images(curves),
        "example": example_effect() if shows_how_to_add else "",
        "has_after": any(c.after is not None for c in cells), "has_worse": bool(summary.worse(cells)),
        "has_intervals": any(c.low is not None for c in cells), "version": __version__})


def example_effect() -> str:
    """The text of the example effect file."""
    return (resources.files("airtouch.simulation.effects") / "own_effect.py.txt").read_text("utf-8")


def _notes(notes: Sequence[str], curves: Curves | None) -> list[str]:
    """The notes, and one more if plots cannot be drawn for want of matplotlib."""
    return [*notes, *([NO_PLOTS] if curves is not None and lacking("plots") else [])]


class Plot(NamedTuple):
    """A plot of the page: its name, one of PLOTS; its title, the text below it, and what draws it."""

    name: str
    title: str
    text: str
    draw: Callable[[], "Figure"]


def figures(curves: Curves | None) -> dict[str, "Figure"]:
    """The plots of the page by their names, as far as there are any. Needs matplotlib."""
    return {plot.name: plot.draw() for plot in _plots(curves)}


def plot_files(folder: Path) -> list[Path]:
    """The files that `write_plots` may write to a folder."""
    return [folder / f"{name}.{form}" for name in PLOTS for form in ("svg", "pdf")]


def write_plots(folder: Path, curves: Curves | None, force: bool = False) -> list[Path]:
    """Write the plots of the page to a folder, each as SVG and PDF, and return the files; needs matplotlib.

    Raises AirTouchError for a file that exists, without `force`; with it, one of a plot that there is not is removed.
    """
    from airtouch.report.style import write_image

    make_folder(folder)
    drawn = figures(curves)
    for file in plot_files(folder):
        if file.stem in drawn:
            write_image(drawn[file.stem], file, force)
        elif force:
            file.unlink(missing_ok=True)
    return [file for file in plot_files(folder) if file.stem in drawn]


def _images(curves: Curves | None) -> list[dict[str, str]]:
    """The plots as data URLs, each with title and text; none where they are not asked for or cannot be drawn.

    Where a second core is idle, a second process draws some of them at the same time.
    """
    if curves is None or lacking("plots"):
        return []
    plots = _plots(curves)
    drawn = map_on_two_cores(lambda plot: embedded(plot.draw()), plots)
    return [{"title": plot.title, "data": data, "text": plot.text} for plot, data in zip(plots, drawn, strict=True)]


def _plots(curves: Curves | None) -> list[Plot]:
    """Plots of the headline's signal, of the gap's spectra and of the commands' spectra, as far as there are any."""
    from airtouch.report import gap_figures

    plots: list[Plot] = []
    if curves is None:
        return plots
    if curves.signal is not None:
        signal = curves.signal
        phases = {KINDS[kind] for kind in np.unique(signal.phase)}
        caption = [f"Flight {Path(signal.flight).name}.", *([curves.remark] if curves.remark else []),
                   *([BEFORE_AFTER] if signal.after is not None else []),
                   *([FLOOR_DRAWN] if np.isfinite(signal.floor).any() else []),
                   *([f"Blue bar: the phase of the answer's cell ({place_in_words(signal.cell)})."]
                     if signal.cell is not None and signal.cell.phase in phases else []),
                   *(["Light blue: take-off and landing."] if phases & {"take-off", "landing"} else []),
                   *(["Yellow: over a platform."] if "over platform" in phases else []),
                   *(["Green bar: the effect acts."] if signal.acts_s else []),
                   *_curves_of_a_random_effect(curves), AXIS_LIMITS]
        low, high = signal.band_hz
        plots.append(Plot("signal", f"{gap_tables.capital(CHANNEL_WORDS[signal.channel])}, {low:g}-{high:g} Hz",
                          " ".join(caption), partial(gap_figures.signals, signal)))
    if curves.spectra:
        has_after = any(spectrum.after is not None for spectrum in curves.spectra)
        text = (f"Mean over the flights (if there are more than {MOST_FLIGHTS}, over {MOST_FLIGHTS} of them, first "
                "those that have the phase of the answer's cell"
                + (", of these first those in which a named passing effect acts). " if has_after else "). "))
        text += f"{curves.remark} " if curves.remark else ""
        text += f"{BEFORE_AFTER} " if has_after else ""
        if any(spectrum.floor is not None for spectrum in curves.spectra):
            text += "Floor: the same of the baseline flights; with few or none, the noise of the sensors. "
        text += "The lowest frequency holds a part of a constant gap."
        if curves.random:
            text += (" A random effect cannot be predicted sample by sample: its green curve is the floor times "
                     "the ratio of the power to the expected one. Below the floor it predicts too much, which the map "
                     "counts as gap.")
        plots.append(Plot("spectra", "Spectra of the gap in the air", text,
                          partial(gap_figures.spectra, curves.frequency_hz, curves.spectra)))
    if curves.commands is not None:
        plots.append(Plot("commands", "Spectra of the motor commands",
                          "Delays, gains and noise in the loop show here, as a shape that differs. They are looked for "
                          "in the loops of thrust, roll and pitch alone, so the yaw command is not drawn.",
                          partial(gap_figures.commands, curves.commands)))
    return plots


def _curves_of_a_random_effect(curves: Curves) -> list[str]:
    """What the curves of the signal with a random effect are; nothing without one."""
    if not curves.random or curves.signal is None:
        return []
    if curves.signal.after is None:
        return ["The effect is random and has no mean in this channel, so no curve is drawn with it."]
    return ["Of a random effect these curves hold the mean alone."]


def _flights(names: Sequence[str], vehicle: str, baseline: Sequence[str]) -> str:
    """Which flights of which vehicle the page is about, and what they are compared with."""
    return (f"Flights: {_few(names)}. Vehicle: {vehicle}. "
            + (f"Baseline: {_few(baseline)}." if baseline else "No baseline flights were given."))


def _few(names: Sequence[str]) -> str:
    """The file names of the first MOST_NAMED flights, and how many more there are."""
    first_names = ", ".join(Path(n).name for n in names[:MOST_NAMED])
    return f"{first_names} and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else first_names
