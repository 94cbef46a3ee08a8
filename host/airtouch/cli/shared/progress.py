"""A progress bar that several commands and the scripts of tools share."""

from collections.abc import Iterator, Sequence
from typing import TypeVar

_T = TypeVar("_T")


class Bar:
    """A progress bar on stderr: call it with (done, total[, note]). The seconds run on a terminal, called or not.

    Work of which it was told nothing counts as one step, done at the end.
    """

    def __init__(self, name: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        self.progress = Progress(TextColumn(name), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
                                 TextColumn("{task.fields[note]}"), console=Console(stderr=True))
        self.task = self.progress.add_task(name, total=None, note="")

    def __enter__(self) -> "Bar":
        self.progress.start()
        return self

    def __exit__(self, failure: object, *_: object) -> None:
        if failure is None and self.progress.tasks[0].total is None:
            self(1, 1)
        self.progress.stop()

    def __call__(self, done: int, total: int, note: str = "") -> None:
        self.progress.update(self.task, completed=done, total=total, note=note)


def with_bar(items: Sequence[_T], name: str) -> Iterator[_T]:
    """The items one after another, with a bar on stderr of how many are done."""
    with Bar(name) as bar:
        for done, item in enumerate(items):
            bar(done, len(items))
            yield item
        bar(len(items), len(items))
