"""Output that `evaluate`, `crossval` and `demo` share."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table

from airtouch.logs.files import make_folder, write_bytes
from airtouch.report.columns import COLUMNS, cell

INTERVALS = "second line: 95 % interval, bootstrap by flight. "
CAPTION = ("missed: no detection is within 1.5 s of the edge. "
           "false/min: detections a minute that belong to no edge; each edge has one at most. "
           "in 0.05 m: fraction of all true edges, missed ones included, whose error is at most 0.05 m.")
WIDE = 150  #: columns of a terminal on which a row of figures fits
SUMMARY_WIDTH, NAME_WIDTH = 17, 22  #: columns of a summary, and of the figures' names, where they stand side by side
SIDE_BY_SIDE = [{"s": "mean |error|, s"}.get(name, name) for name in ("flights", "edges", *COLUMNS)]


def print_table(screen: Console, rows: Mapping[str, dict[str, Any]], title: str) -> None:
    """Print figures and intervals of each summary: a row for each, or on a narrow terminal a column for each."""
    has_intervals = any("\n" in figure for row in rows.values() for figure in _cells(row))
    caption = INTERVALS * has_intervals + CAPTION
    if screen.width >= WIDE:
        screen.print(_table(title, ["", "flights", "edges", *COLUMNS],
                            [[name, *_cells(row)] for name, row in rows.items()], caption))
        return
    names = list(rows)
    count = max((screen.width - NAME_WIDTH) // SUMMARY_WIDTH, 1)
    for first in range(0, len(names), count):
        shown = names[first:first + count]
        last = first + count >= len(names)
        screen.print(_table(title if first == 0 else "", ["", *shown],
                            zip(SIDE_BY_SIDE, *(_cells(rows[name]) for name in shown), strict=True),
                            caption if last else ""))


def _cells(row: dict[str, Any]) -> list[str]:
    """The figures of a summary, each interval on a second line."""
    figures = ("\n".join(filter(None, cell(row, *form))) for form in COLUMNS.values())
    return [str(row["flights"]), str(row["edges"]), *figures]


def _table(title: str, head: Sequence[str], lines: Iterable[Sequence[str]], caption: str) -> Table:
    result = Table(title=title or None, title_justify="left", show_lines=True, caption_justify="left",
                   caption=caption or None)
    for name in head:
        result.add_column(name, justify="right" if name else "left")
    for line in lines:
        result.add_row(*line)
    return result


def console() -> Console:
    """Standard output; if it is no terminal, wide enough for the table."""
    output = Console()
    return output if output.is_terminal else Console(width=170)


def left_out(failures: list[tuple[str, str]], scored: int) -> None:
    """Print the numbers of scored and left-out flights on stderr."""
    if failures:
        click.echo(f"airtouch: {scored} flights scored, {len(failures)} left out (see above)", err=True)


def write_json(path: Path, content: dict[str, Any], force: bool) -> None:
    """Write JSON, whole or not at all, and make its folder. Raises AirTouchError for a file that exists."""
    make_folder(path.parent)
    write_bytes((json.dumps(content, indent=1, allow_nan=False) + "\n").encode(), path, force)
