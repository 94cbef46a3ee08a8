"""Independent pieces of one diagnosis shared with a second process, where this one has another core to itself."""

import io
import multiprocessing
import os
import pickle
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from airtouch.simulation.effects import Effect, get

Item = TypeVar("Item")
Result = TypeVar("Result")
MOST_ITEMS = 255  #: that are shared at once: each is one byte in a pipe


def map_on_two_cores(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """`function` of each item, in their order.

    Where another core is free for this process, a fork of it does some of them: whoever is ready takes the next.
    What the fork computes beside its results is lost. `function` must depend on its item alone and print nothing.
    """
    items = list(items)
    if not 2 <= len(items) <= MOST_ITEMS or not spare_core():
        return [function(x) for x in items]
    tickets, filled = os.pipe()  # one byte for each item, which one process reads
    os.write(filled, bytes(range(len(items))))
    os.close(filled)
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    other = context.Process(target=_do_items, args=(function, items, tickets, theirs), daemon=True)
    other.start()
    theirs.close()
    try:
        done = {i: function(items[i]) for i in _taken(tickets)}
        done |= _received(ours)
    finally:
        other.kill()
        other.join()
        os.close(tickets)
        ours.close()
    return [done[i] if i in done else function(x) for i, x in enumerate(items)]  # it may have failed: then as ever


def spare_core() -> bool:
    """Whether this process may fork and has a second core: no worker itself, without one, and in its main thread."""
    return (sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1 and multiprocessing.parent_process() is None
            and not multiprocessing.active_children() and threading.current_thread() is threading.main_thread())


def _taken(tickets: int) -> Iterator[int]:
    """Numbers of the items that this process is to do."""
    while byte := os.read(tickets, 1):
        yield byte[0]


def _do_items(function: Callable[[Any], Any], items: list, tickets: int, results: Connection) -> None:
    """Do items as long as there are any, and send them all; nothing if one fails, so that it fails in the parent."""
    sys.stderr = open(os.devnull, "w")  # another thread of the parent may have held the lock of its own  # noqa: SIM115
    done = {i: function(items[i]) for i in _taken(tickets)}
    buffer = io.BytesIO()
    _Pickler(buffer, pickle.HIGHEST_PROTOCOL).dump(done)
    results.send_bytes(buffer.getbuffer())


def _received(results: Connection) -> dict[int, Any]:
    """The items that the other process did; none if it died."""
    try:
        return _Unpickler(io.BytesIO(results.recv_bytes())).load()
    except (EOFError, OSError):  # the latter where it died in the middle of a message
        return {}


class _Pickler(pickle.Pickler):
    """Leaves effects out, whose machine code both processes have."""

    def persistent_id(self, obj: Any) -> str | None:
        """The name of an effect."""
        return obj.name if isinstance(obj, Effect) else None


class _Unpickler(pickle.Unpickler):
    """Puts the registered effects back."""

    def persistent_load(self, pid: Any) -> Effect:
        """The effect of a name."""
        return get(pid)
