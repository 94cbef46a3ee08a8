"""Modules that a command loads when it is called."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def loaded_for_good() -> Iterator[None]:
    """A context in which modules are loaded, among which Python looks for no garbage, then or later.

    They stay, so that it would find none; in one diagnosis it looked for 0.3 s.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()  # what is there now is left out of later searches
        gc.enable()
