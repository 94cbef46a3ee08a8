"""Folders that a command makes for its results."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from airtouch.logs.files import make_folder


@contextmanager
def made_folder(folder: Path) -> Iterator[None]:
    """Make a folder for the block; if the block fails, those that were made and are empty go again.

    Raises AirTouchError where it cannot be made.
    """
    new = [path for path in (folder, *folder.parents) if not path.exists()]
    make_folder(folder)
    try:
        yield
    except BaseException:
        for path in new:
            if any(path.iterdir()):
                break
            path.rmdir()
        raise
