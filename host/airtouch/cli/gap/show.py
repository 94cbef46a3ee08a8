"""The output of `airtouch gap`: tables and sentences."""

from collections.abc import Callable, Iterable, Sequence

import click
from rich.console import Console
from rich.table import Table

from airtouch.gap.answer import words
from airtouch.gap.answer.sentences import sentences
from airtouch.gap.measurement import Measurement
from airtouch.gap.result import Diagnosis
from airtouch.gap.signals.channels import CHANNEL_WORDS
from airtouch.gap.where.cell import Cell
from airtouch.gap.where.cell_words import gap, interval, short
from airtouch.gap.where.summary import significant

MOST_CELLS = 16  #: rows of a table of cells, largest first; no source: fits a terminal
#: column of a table of cells -> (text of a cell, columns of the narrowest terminal that shows it)
CELL_COLUMNS: dict[str, tuple[Callable[[Cell], str], int]] = {
    "phase": (lambda c: c.phase, 0),
    "regime": (lambda c: "" if c.regime == "all" else c.regime, 0),
    "channel": (lambda c: CHANNEL_WORDS[c.channel], 0),
    "band, Hz": (lambda c: f"{c.band_hz[0]:g}-{c.band_hz[1]:g}", 0),
    "gap": (gap, 0),
    "interval": (interval, 125),
    "unit": (lambda c: c.unit, 100),
    "floor": (lambda c: short(c.floor), 100),
    "gap/floor": (lambda c: short(c.ratio), 0),
    "after": (lambda c: "" if c.after is None else short(c.after), 0),
}
NUMBERS = ("gap", "floor", "gap/floor", "after")


def cell_table(cells: Iterable[Cell], title: str, width: int) -> Table:
    """A table of cells of a gap map for a terminal of a width; a column that says nothing is left out."""
    cells = list(cells)[:MOST_CELLS]
    inside = bool(cells) and not significant(cells[0])
    caption = ("90 % intervals; a cell is listed when its interval clears the floor's"
               + ("; the first, which does not, is that of the answer" if inside else ""))
    if cells and all(c.low is None for c in cells):
        caption = "these cells have no interval; all of them are listed"
    table = Table(title=title, title_justify="left", caption_justify="left", caption=caption)
    columns = [(name, text) for name, (text, least) in CELL_COLUMNS.items()
               if width >= least and any(text(cell) for cell in cells)]
    for name, _ in columns:
        table.add_column(name, justify="right" if name in NUMBERS else "left", no_wrap=name != "regime")
    for cell in cells:
        table.add_row(*(text(cell) for _, text in columns))
    return table


def measurement(screen: Console, result: Measurement) -> None:
    """Print a measurement."""
    count = len(result.flights)
    screen.print(f"{count} flight{'s' * (count != 1)} against {result.vehicle}; floor: {result.map.floor_from}"
                 + (f" ({len(result.baseline)})" if result.baseline else ""))
    if result.where:
        screen.print(cell_table(result.where, "Largest cells of the gap", screen.width))
    else:
        screen.print("No cell of the gap stands out from its floor.")
    _, overall = result.sentences
    screen.print(overall)
    remarks(screen, "Rotor speeds in the air", [r.in_words() for r in result.rotors])
    remarks(screen, "What these logs cannot say", result.cannot)
    remarks(screen, "Notes", result.notes)


def diagnosis(screen: Console, result: Diagnosis) -> None:
    """Print a diagnosis: sentences, effects, ranking, largest cells and next steps."""
    for sentence in sentences(result):
        screen.print(sentence)
    for effect in result.effects:
        screen.print("  " + words.effect_in_words(effect))
    table = Table(title="Ranking", title_justify="left", caption_justify="left",
                  caption="shrink: part of the gap above the floor that goes away on "
                          f"{words.data_of_shrink(result)}, with its 90 % interval; -: not measured")
    for name in ("candidate", "probability", "shrink"):
        table.add_column(name, justify="left" if name == "candidate" else "right", no_wrap=True)
    table.add_column("why it is not the answer", ratio=1)
    for r in words.leading(result.ranking):
        shrink = words.quantity(r.shrink, words.SHRINK_FORM) if r.measured else "-"
        table.add_row(r.name, f"{r.probability:.1%}", shrink, r.why)
    screen.print(table)
    for group in result.indistinguishable:
        screen.print(f"cannot be told apart here: {', '.join(group)}")
    if result.where:
        screen.print(cell_table(result.where, "Where", screen.width))
    remarks(screen, "What stays open", words.all_open_in_words(result.unexplained))
    remarks(screen, "Other near effects", words.nearest_in_words(result))
    if result.next:
        screen.print("Next:")
    for step in result.next:
        page = f" (host/docs/effects.md, {step.page!r})" if step.page else ""
        screen.print(f"  - {step.text}{page}", highlight=False)
        if step.command:
            # Not wrapped: a line break within a copied command would end it.
            screen.print(f"      {step.command}", highlight=False, soft_wrap=True)
    remarks(screen, "What these logs cannot say", result.cannot)
    remarks(screen, "Notes", result.notes)


def remarks(screen: Console, title: str, lines: Sequence[str]) -> None:
    """Print a list with a heading; an empty list prints nothing."""
    if lines:
        screen.print(f"{title}:")
    for line in lines:
        screen.print(f"  - {line}", highlight=False)


def left_out(reasons: Iterable[str]) -> None:
    """Print the flights that could not be used on stderr."""
    for reason in reasons:
        click.echo(f"airtouch: left out: {reason}", err=True)
