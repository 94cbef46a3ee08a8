"""What a diagnosis works out once: one owner of everything that is kept."""

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Kept = TypeVar("Kept")
MOST = 500  #: values of one kind


class Workspace:
    """Values by what they are and of what they are; of one kind those least recently used go first.

    Flights, loops and problems have one each (`field(default_factory=Workspace, init=False)`), so that a changed copy
    begins with nothing. So does one in another process: what would be sent is larger than the work of making it anew.
    """

    def __init__(self) -> None:
        self._kept: dict[str, dict[Hashable, Any]] = {}

    def __reduce__(self) -> tuple[type["Workspace"], tuple[()]]:
        return Workspace, ()

    def once(self, what: str, of: Hashable, make: Callable[[], Kept], most: int = MOST) -> Kept:
        """The value of a kind and key, made when it is not there; at most so many of the kind are kept."""
        kept = self._kept.setdefault(what, {})
        value = kept.pop(of) if of in kept else make()
        kept[of] = value
        if len(kept) > most:
            kept.pop(next(iter(kept)))
        return value
