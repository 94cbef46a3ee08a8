"""The one exception that users see, and text from files made fit for its message."""

import difflib
from collections.abc import Iterable


class AirTouchError(ValueError):
    """Bad input, said in one line: the file, the place in it and the remedy.

    The command line prints it without a traceback and exits with code 2.
    """


def shown(text: str, most: int = 40) -> str:
    """At most `most` characters of a text that a file brought with it, unprintable ones as escapes."""
    short = text if len(text) <= most else text[:most - 3] + "..."
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in short)


def nearest(name: str, known: Iterable[str]) -> str:
    """`; did you mean a or b?` for the known names that are close to one that is not, "" where none is."""
    folded = {k.lower(): k for k in known}
    close = [folded[k] for k in difflib.get_close_matches(name.lower(), folded, 3)]
    return f"; did you mean {' or '.join(close)}?" if close else ""
