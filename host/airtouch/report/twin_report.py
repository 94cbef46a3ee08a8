"""The page of `airtouch twin`: recorded and simulated flights side by side."""

from collections.abc import Sequence
from importlib import resources
from pathlib import Path

import jinja2
import numpy as np

from airtouch import __version__
from airtouch.logs.files import write_bytes
from airtouch.report import twin_figures
from airtouch.report.write import embed
from airtouch.twin.compare import Comparison, Gap
from airtouch.twin.features import CLASSES
from airtouch.twin.flights import Recorded
from airtouch.twin.levers import Lever
from airtouch.twin.two_sample import Auroc

MOST_GAPS = 30
CLOSED = 0.6  #: an AUROC below it counts as hard to tell


def write_report(path: Path, recorded: Recorded, found: Comparison, levers: Sequence[Lever], values: np.ndarray,
                 first: dict[str, float], *, command: str, force: bool = False) -> None:
    """One self-contained HTML file. first: the misfit by group before the fit."""
    images = [("One flight and its twin", "", twin_figures.overlaid(recorded, found.flown)),
              ("Spectra in free air", "", twin_figures.spectra(recorded, found.flown))]
    for name in CLASSES:
        picture = twin_figures.edges(recorded, found.flown, name)
        if picture is not None:
            images.append(("Around the edges, medians and quartiles", twin_figures.class_in_words(name), picture))
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, undefined=jinja2.StrictUndefined)
    template = environment.from_string((resources.files("airtouch.report") / "twin.html").read_text("utf-8"))
    page = template.render(
        answer=answer(found.auroc), auroc=found.auroc, misfit=[(g, first.get(g), v) for g, v in found.misfit.items()],
        gaps=[gap_row(g) for g in found.gaps[:MOST_GAPS]],
        levers=[(lever.name, f"{value:.4g}", f"{lever.start:.4g}", lever.unit)
                for lever, value in zip(levers, values, strict=True)],
        images=[(title, text, embed(data)) for title, text, data in images],
        flights=len(recorded.courses), simulated=len(found.flown), lost=found.lost, left_out=recorded.left_out,
        speeds=sorted({c.speed_from for c in recorded.courses}), command=command, version=__version__)
    write_bytes(page.encode(), path, force)


def answer(auroc: Sequence[Auroc]) -> str:
    """The result in a sentence."""
    if not auroc:
        return "Too few flights of any phase for a classifier to be scored."
    worst = max(auroc, key=lambda a: a.value)
    best = min(auroc, key=lambda a: a.value)
    if worst.value < CLOSED:
        return f"A classifier hardly tells the twin from the drone: AUROC {worst.value:.2f} at most ({worst.phase})."
    return (f"A classifier tells the twin from the drone with AUROC {best.value:.3f} ({best.phase}) to "
            f"{worst.value:.3f} ({worst.phase}); 0.5 is closed.")


def gap_row(gap: Gap) -> tuple[str, str, str, str, int]:
    """(where, what, difference with unit, in scatters, flights) of one feature."""
    digits = ".0f" if gap.feature.unit in ("PWM", "PWM/s") else ".2f"
    unit = "" if gap.feature.unit == "1" else f" {gap.feature.unit}"
    return (gap.feature.group, gap.feature.name, f"{gap.difference:+{digits}}{unit}", f"{gap.scatters:+.1f}",
            gap.flights)
