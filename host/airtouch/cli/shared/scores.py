"""Output that `evaluate`, `crossval` and `demo` share."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table

from airtouch.logs.files import make_folder, write_bytes
from airtouch.report.columns import COLUMNS, cell


def table(rows: Mapping[str, dict[str, Any]], title: str) -> Table:
    """A table with a row of figures and intervals for each summary."""
    result = Table(title=title, title_justify="left", show_lines=True, caption_justify="left",
                   caption="second line: 95 % interval, bootstrap by flight. A miss has no detection within "
                           "1.5 s; a detection serves one edge, the others are false. "
                           "Hits: share of all true edges.")
    for name in ("", "flights", "edges", *COLUMNS):
        result.add_column(name, justify="left" if not name else "right")
    for name, row in rows.items():
        cells = (cell(row, *how) for how in COLUMNS.values())
        result.add_row(name, str(row["flights"]), str(row["edges"]), *cells)
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
