"""The page: every figure, the paper's numbers beside the reproduced ones, and a verdict on each claim."""

import csv
import io
from collections import Counter
from pathlib import Path
from typing import Any

from airtouch.logs.files import write_bytes
from airtouch.paper_figures import words
from airtouch.paper_figures.claims import CLAIMS, NOT_REPRODUCED, REPRODUCED, UNDECIDED, UNTESTABLE
from airtouch.report.html_page import data_url, rendered

CLASSES = {REPRODUCED: "yes", NOT_REPRODUCED: "no", UNDECIDED: "open", UNTESTABLE: "open"}


def write(out: Path, records: dict[str, dict[str, Any]]) -> Path:
    """Write `index.html` to the folder `out`. It is self-contained except for links to each figure's SVG and CSV.

    records: name of a figure -> its record (`run.record`). Returns the file.
    """
    verdicts = [(entry, claim) for entry in records.values() for claim in entry["claims"].values()]
    count = Counter(claim["verdict"] for _, claim in verdicts)
    text = rendered(
        "page.html", folder="airtouch.paper_figures",
        records=[{**entry, "image": _image(out, entry)} for entry in records.values()], classes=CLASSES, count=count,
        verdicts=CLASSES, untestable=UNTESTABLE, total=len(CLAIMS), judged=len(verdicts),
        error_margin=f"{100 * words.ERROR_MARGIN:g}", share_margin=f"{100 * words.SHARE_MARGIN:g}",
        most_missed=f"{100 * words.MOST_MISSED:g}", quick=any(entry.get("quick") for entry in records.values()))
    path = out / "index.html"
    write_bytes(text.encode(), path, force=True)
    return path


def cells(table: bytes) -> list[list[str]]:
    """The cells of a CSV by row, the header first."""
    return list(csv.reader(io.StringIO(table.decode())))


def _image(out: Path, entry: dict[str, Any]) -> str:
    return "" if "missing" in entry else data_url((out / f"{entry['name']}.png").read_bytes())
