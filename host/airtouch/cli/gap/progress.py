"""What `airtouch gap` shows while it works. Imports nothing slow: it is shown while the rest is imported."""

import threading
import time

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

PATIENCE_S = 1.0


class Bar:
    """A progress bar on stderr that appears when the work takes longer than PATIENCE_S.

    Call it with a description of each step. total: number of steps, None if unknown.
    """

    def __init__(self, total: int | None = None, text: str = "loading") -> None:
        self.progress = Progress(SpinnerColumn(), TextColumn("{task.description}"), BarColumn(),
                                 TimeElapsedColumn(), console=Console(stderr=True), transient=True)
        self.task = self.progress.add_task(text, total=total)
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

    def expect(self, total: int) -> None:
        """Set the number of steps, once it is known."""
        self.progress.update(self.task, total=total, completed=0)


class Steps:
    """Prints the seconds since the start and the present step every LINE_S. Call it with each step."""

    LINE_S = 1.5

    def __init__(self, began: float) -> None:
        self.began, self.text = began, ""
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
