"""The command line as it was typed, for reports and models."""

import shlex
import sys
from itertools import groupby


def typed(most: int | None = None) -> str:
    """The command as typed, quoted for a shell, without the folder of the `airtouch` program.

    most: names in a row that are written out; what comes after them is counted, and the line is no command then. All
    are, if left out.
    """
    parts: list[str] = []
    for is_option, row in groupby(sys.argv[1:], lambda word: word.startswith("-")):
        words = [shlex.quote(word) for word in row]
        shown = words if is_option else words[:most]
        parts += shown + ([f"[and {len(words) - len(shown)} more]"] if len(shown) < len(words) else [])
    return " ".join(["airtouch", *parts])
