"""Types of arguments for programs that use argparse, which are those in `tools`."""

import argparse
from collections.abc import Callable


def whole_number(least: int) -> Callable[[str], int]:
    """A whole number from `least` on, for argparse."""
    def read_number(text: str) -> int:
        """The text as a whole number of at least `least`. Raises ArgumentTypeError for any other."""
        try:
            if (value := int(text)) >= least:
                return value
        except ValueError:
            pass
        raise argparse.ArgumentTypeError(f"{text} is no whole number from {least} on")
    return read_number
