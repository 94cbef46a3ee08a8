"""What is made of each figure: a table, a picture, a caption, and a verdict on each claim of the paper."""

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from airtouch.errors import AirTouchError


class Missing(AirTouchError):
    """What a figure needs is not there; the message says what, and how to get it."""


@dataclass(frozen=True)
class Job:
    """What figures are made from.

    flights: folder of recorded flights with a manifest, or None. work: folder in which finished folds and trained
    networks are kept. quick: fewer flights, folds and training steps. power_log: INA219 log with a column of stages,
    or None. tell: gets a line for each step.
    """

    flights: Path | None
    work: Path
    quick: bool = False
    power_log: Path | None = None
    tell: Callable[[str], None] = lambda _: None


@dataclass(frozen=True)
class Verdict:
    """reproduced, not reproduced or cannot be tested here, and what was found: figures with n and interval."""

    verdict: str
    found: str


@dataclass(frozen=True)
class Figure:
    """A figure made again. rows: the table, one dict a row. draw: puts the picture on an empty matplotlib figure.

    verdicts: claim of `claims.SAID` -> verdict; every claim of the figure has one.
    """

    title: str
    rows: list[dict[str, Any]]
    caption: str
    verdicts: dict[str, Verdict]
    draw: Callable[[Any], None]


def table_csv(rows: Sequence[dict[str, Any]]) -> bytes:
    """The rows as CSV, a column for each key, in the order in which keys first appear."""
    names = list(dict.fromkeys(key for row in rows for key in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows({k: _plain(v) for k, v in row.items()} for row in rows)
    return text.getvalue().encode()


def _plain(value: Any) -> Any:
    return f"{value:.6g}" if isinstance(value, float) else "" if value is None else value
