"""A reproduced figure: a table, a picture, a caption, and a verdict on each claim of the paper."""

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from airtouch.errors import AirTouchError


class Missing(AirTouchError):
    """Input of a figure is missing. The message names it, and says how to get it."""


@dataclass(frozen=True)
class Job:
    """The input and settings of a run.

    flights: folder of recorded flights with a manifest, or None. work: folder for finished folds and trained
    networks. quick: fewer flights, folds and training steps. power_log: INA219 log with a column of stages, or
    None. tell: called with a line for each step.
    """

    flights: Path | None
    work: Path
    quick: bool = False
    power_log: Path | None = None
    tell: Callable[[str], None] = lambda _: None


@dataclass(frozen=True)
class Verdict:
    """A verdict of `claims` (reproduced, undecided, ...) and the figures behind it, with n and interval.

    judged: the detector, or what else the verdict is on.
    """

    verdict: str
    evidence: str
    judged: str = "the paper's method"


@dataclass(frozen=True)
class Figure:
    """A reproduced figure.

    rows: the table, one dict for each row. draw: draws the picture on an empty matplotlib figure.
    verdicts: claim of `claims.CLAIMS` -> verdict, for every claim of the figure.
    """

    title: str
    rows: list[dict[str, Any]]
    caption: str
    verdicts: dict[str, Verdict]
    draw: Callable[[Any], None]


def table_csv(rows: Sequence[dict[str, Any]]) -> bytes:
    """The rows as CSV, with a column for each key in order of first appearance."""
    names = list(dict.fromkeys(key for row in rows for key in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows({k: _plain(v) for k, v in row.items()} for row in rows)
    return text.getvalue().encode()


def _plain(value: Any) -> Any:
    return f"{value:.6g}" if isinstance(value, float) else "" if value is None else value
