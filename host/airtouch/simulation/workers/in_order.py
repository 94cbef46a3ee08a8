"""Work sent out a little ahead, its results taken in order, from threads, processes or a cluster.

`simulation.workers.cluster` takes flights in any order, in a loop of its own.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import Any


def in_order(submit: Callable[[Any], Any], items: Iterable[Any], ahead: int) -> Iterator[Any]:
    """The results of `submit(item)`, futures, in the order of the items; at most `ahead` are in progress.

    Items are taken as they are sent. What waits when the caller stops, or when one fails, is cancelled. Raises what
    `submit` and the futures raise.
    """
    items = iter(items)
    waiting = deque(submit(item) for item in islice(items, ahead))
    try:
        while waiting:
            result = waiting.popleft().result()
            waiting.extend(submit(item) for item in islice(items, 1))
            yield result
    finally:
        for future in waiting:
            future.cancel()
