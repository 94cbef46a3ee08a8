"""Few that stand for many: flights, or whatever else a list holds, evenly spaced over it."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

_T = TypeVar("_T")


def evenly_spaced(items: Sequence[_T], most: int) -> list[_T]:
    """At most `most` of the items in their order, evenly spaced: both ends, of one item the first."""
    if not items:
        return []
    return [items[i] for i in np.unique(np.linspace(0, len(items) - 1, most).astype(int))]
