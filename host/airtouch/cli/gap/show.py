"""The output of `airtouch gap`: tables, sentences, and a progress bar for long work."""

import threading
import time
from collections.abc import Iterable, Sequence

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from airtouch.gap.answer import words
from airtouch.gap.measure import Measurement
from airtouch.gap.result import Cell, Diagnosis
from airtouch.gap.where import summary
from airtouch.gap.where.gap_map import CHANNEL_WORDS, interval, ratio, short

PATIENCE_S = 2.0
MOST_CELLS = 16


class Bar:
    """A progress bar on stderr that appears when the work takes more than two seconds.

    Call it with a description of each step. total: number of steps, None if unknown.
    """

    def __init__(self, total: int | None = None) -> None:
        self.progress = Progress(SpinnerColumn(), TextColumn("{task.description}"), BarColumn(),
                                 TimeElapsedColumn(), console=Console(stderr=True), transient=True)
        self.task = self.progress.add_task("", total=total)
        self.timer = threading.Timer(PATIENCE_S, self.progress.start)
        self.timer.daemon = True

    def __enter__(self) -> "Bar":
        self.timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.timer.cancel()
        self.progress.stop()

    def __call__(self, text: str) -> None:
        self.progress.update(self.task, advance=1, description=text[-60:])


class Steps:
    """Prints the seconds since the start and the present step every LINE_S. Call it with each step."""

    LINE_S = 1.5

    def __init__(self, began: float) -> None:
        self.began, self.last, self.text = began, 0.0, ""
        self.stopped = threading.Event()
        self.thread = threading.Thread(target=self._tick, daemon=True)

    def __enter__(self) -> "Steps":
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stopped.set()
        self.thread.join()

    def __call__(self, text: str) -> None:
        self.text = text

    def _tick(self) -> None:
        """Print a line every LINE_S, also during a long step."""
        while not self.stopped.wait(self.LINE_S):
            click.echo(f"[{time.monotonic() - self.began:4.0f} s] {self.text}", err=True)


def cells(some: Iterable[Cell], title: str) -> Table:
    """A table of cells of a gap map."""
    some = list(some)[:MOST_CELLS]
    after = any(c.after is not None for c in some)
    table = Table(title=title, title_justify="left", caption_justify="left",
                  caption="90 % intervals; a cell is listed when its interval clears the floor's")
    for name in ("phase", "regime", "channel", "band, Hz", "gap", "interval", "unit", "floor", "gap/floor"):
        right = name in ("gap", "floor", "gap/floor")
        table.add_column(name, justify="right" if right else "left", no_wrap=name != "regime")
    if after:
        table.add_column("after", justify="right")
    for c in some:
        row = [c.phase, "" if c.regime == "all" else c.regime, CHANNEL_WORDS[c.channel],
               f"{c.band_hz[0]:g}-{c.band_hz[1]:g}", f"{short(c.gap)}",
               interval(c), c.unit, f"{short(c.floor)}",
               short(ratio(c))]
        table.add_row(*row, *([("" if c.after is None else f"{short(c.after)}")] if after else []))
    return table


def measurement(screen: Console, found: Measurement) -> None:
    """Print a measurement."""
    count = len(found.flights)
    screen.print(f"{count} flight{'s' * (count != 1)} against {found.vehicle}; floor: {found.map.floor_from}"
                 + (f" ({len(found.baseline)})" if found.baseline else ""))
    if found.where:
        screen.print(cells(found.where, "Largest cells of the gap"))
    else:
        screen.print("No cell of the gap stands out of its floor.")
    screen.print(words.overall(found.gap))
    remarks(screen, "Rotor speeds in the air", [words.rotor_in_words(r) for r in found.rotors])
    remarks(screen, "What these logs cannot say", found.cannot)
    remarks(screen, "Notes", found.notes)


def diagnosis(screen: Console, found: Diagnosis) -> None:
    """Print a diagnosis: sentences, effects, ranking, largest cells and next steps."""
    for sentence in words.sentences(found):
        screen.print(sentence)
    for effect in found.effects:
        screen.print("  " + words.effect_in_words(effect))
    table = Table(title="Ranking", title_justify="left", caption_justify="left",
                  caption="shrink: part of the gap above the floor that goes away on data held out, 90 %")
    for name in ("candidate", "probability", "shrink"):
        table.add_column(name, justify="left" if name == "candidate" else "right", no_wrap=True)
    table.add_column("why it is not the answer", ratio=1)
    for r in summary.leading(found.ranking):
        table.add_row(r.name, f"{r.probability:.1%}", words.quantity(r.shrink, "{:.2f}"), r.why)
    screen.print(table)
    for group in found.indistinguishable:
        screen.print(f"cannot be told apart here: {', '.join(group)}")
    if found.where:
        screen.print(cells(found.where, "Where"))
    remarks(screen, "What stays open", [words.open_in_words(u) for u in found.unexplained])
    if found.unexplained:
        remarks(screen, "Nearest effects", words.nearest_in_words(found.unexplained[0]))
    remarks(screen, "Next", [s.text + (f" (host/docs/effects.md, {s.page!r})" if s.page else "")
                             + (f"\n      {s.command}" if s.command else "") for s in found.next])
    remarks(screen, "What these logs cannot say", found.cannot)
    remarks(screen, "Notes", found.notes)


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
