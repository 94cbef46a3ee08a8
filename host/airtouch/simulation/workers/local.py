"""The same flights in local processes that fly and write, for batches where writing is the work."""

import multiprocessing
import os
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from airtouch.errors import AirTouchError
from airtouch.simulation.flight import Chosen, Diverged, fly
from airtouch.simulation.scenario import Scenario
from airtouch.simulation.workers import store
from airtouch.simulation.workers.in_order import in_order
from airtouch.vehicle import Vehicle

AHEAD = 4  #: flights in work or waiting, for each process


def write(folder: Path, scenario: Scenario, numbers: Sequence[int], *, vehicle: Vehicle, effects: Chosen = (),
          without: Sequence[str] = (), seed: int = 0, plugins: Sequence[str] = (), workers: int = 1,
          ) -> Iterator[Diverged | None]:
    """Fly flights and write each into `folder`; yields None, or how the flight diverged, one by one.

    plugins: texts of effect files that each process registers first; with one worker, which is this process, they must
    be registered already. Raises AirTouchError when a process dies (the flights written so far are whole).
    """
    job = (folder, scenario, vehicle, effects, tuple(without), seed)
    if workers == 1:
        yield from (_fly(job, n) for n in numbers)
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context, initializer=_start,
                             initargs=(tuple(plugins),)) as pool:
        try:
            yield from in_order(lambda n: pool.submit(_fly, job, n), numbers, AHEAD * workers)
        except BrokenProcessPool:
            raise AirTouchError("a worker process died; call the same command again to continue") from None


def _start(plugins: Sequence[str]) -> None:
    from airtouch.simulation import effects as registry

    threading.Thread(target=_end_with_parent, daemon=True).start()
    for text in plugins:
        registry.load_text(text)


def _end_with_parent() -> None:
    """A process whose parent was killed would wait for work for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _fly(job: tuple, number: int) -> Diverged | None:
    folder, scenario, vehicle, effects, without, seed = job
    result = fly(scenario, vehicle, seed, number, effects=effects, without=without)
    if isinstance(result, Diverged):
        return result
    store.save(folder, scenario.name, result)
    return None
