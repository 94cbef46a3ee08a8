"""What `airtouch gap` shows while it works. Imports nothing slow: it is shown while the rest is imported."""

import threading
import time

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

PATIENCE_S = 1.0


class StepLines:
    """Prints the seconds since the start and the present step every `line_s`. Call it with each step."""

    LINE_S = 1.5

    def __init__(self, began: float, line_s: float = LINE_S) -> None:
        self.began, self.line_s, self.text = began, line_s, ""
        self.stopped = threading.Event()
        self.thread = threading.Thread(target=self._tick, daemon=True)

    def __enter__(self) -> "StepLines":
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stopped.set()
        self.thread.join()

    def __call__(self, text: str) -> None:
        self.text = text

    def _tick(self) -> None:
        """Print a line every `line_s`, also during a long step."""
        while not self.stopped.wait(self.line_s):
            click.echo(f"[{time.monotonic() - self.began:4.0f} s] {self.text}", err=True)


class LateBar:
    """A progress bar on stderr that appears when the work takes longer than PATIENCE_S; lines without a terminal.

    Call it with a description of each step. total: number of steps, None if unknown. line_s: between two lines without
    a terminal.
    """

    LINE_S = 10.0  #: a log of hours stays short

    def __init__(self, total: int | None = None, text: str = "loading; the first time compiles, for a minute",
                 line_s: float | None = None) -> None:
        console = Console(stderr=True)
        self.progress = Progress(SpinnerColumn(), TextColumn("{task.description}"), BarColumn(),
                                 TimeElapsedColumn(), console=console, transient=True)
        self.task = self.progress.add_task(text, total=total)
        self.timer = threading.Timer(PATIENCE_S, self.progress.start)
        self.timer.daemon = True
        self.lines = None if console.is_terminal else StepLines(time.monotonic(), line_s or self.LINE_S)
        self._say(text)

    def __enter__(self) -> "LateBar":
        if self.lines:
            self.lines.__enter__()
        else:
            self.timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.timer.cancel()
        if self.lines:
            self.lines.__exit__()
        else:
            self.progress.stop()

    def __call__(self, text: str) -> None:
        self.progress.update(self.task, advance=1)
        self.now(text)

    def now(self, text: str) -> None:
        """Describe the present step without ending one."""
        self.progress.update(self.task, description=text[-60:])
        self._say(text)

    def expect(self, total: int) -> None:
        """Set the number of steps, once it is known."""
        self.progress.update(self.task, total=total, completed=0)

    def _say(self, text: str) -> None:
        if self.lines:
            task = self.progress.tasks[0]
            self.lines(f"{text}, step {task.completed:.0f} of {task.total:.0f}" if task.total else text)
