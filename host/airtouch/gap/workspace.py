"""What a diagnosis works out once: one owner of everything that is kept."""

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Kept = TypeVar("Kept")
MOST = 500  #: values of one kind that are kept; chosen


class Workspace:
    """Cached values by kind and key; the least recently used of a kind are dropped first.

    Flights, loops and problems have one each (`field(default_factory=Workspace, init=False)`), so that a changed copy
    begins with nothing. So does one in another process: what would be sent is larger than the work of making it anew.
    """

    def __init__(self) -> None:
        self._kept: dict[str, dict[Hashable, Any]] = {}

    def __reduce__(self) -> tuple[type["Workspace"], tuple[()]]:
        return Workspace, ()

    def cached(self, kind: str, key: Hashable, compute: Callable[[], Kept], most: int = MOST) -> Kept:
        """The value of a kind and key, made when it is not there; at most so many of the kind are kept."""
        values = self._kept.setdefault(kind, {})
        value = values.pop(key) if key in values else compute()
        values[key] = value
        if len(values) > most:
            values.pop(next(iter(values)))
        return value
