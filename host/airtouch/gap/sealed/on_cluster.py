"""Work on flights spread over a dask.distributed cluster (extra `scale`)."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from airtouch.simulation.effects import load_text
from airtouch.simulation.workers import cluster
from airtouch.simulation.workers.in_order import in_order

AHEAD = 64  #: flights sent out and not yet back


def mapper(address: str, plugins: Sequence[str] = ()) -> Callable[[Callable, Iterable], Iterator]:
    """What stands in for `map`: results in order, a few flights ahead.

    plugins: texts of effect files that the workers register first. Raises AirTouchError
    where no scheduler answers.
    """
    client = cluster.connect(address)

    def run(function: Callable, items: Iterable[Any]) -> Iterator[Any]:
        """`map`, by the workers of the cluster."""
        return in_order(lambda item: client.submit(_one, function, item, tuple(plugins), pure=False, retries=3), items,
                        AHEAD)

    return run


def _one(function: Callable, item: Any, plugins: Sequence[str]) -> Any:
    """The function of one item, on a worker that registers the effects first."""
    for text in plugins:
        load_text(text)
    return function(item)
