"""The same flights on a dask.distributed cluster (extra `scale`)."""

import uuid
from collections.abc import Iterator, Sequence
from typing import Any

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation.flight import Chosen, Diverged, fly
from airtouch.simulation.scenario import Scenario
from airtouch.vehicle import Vehicle

AHEAD = 64  #: flights sent out and not yet back


def flights(client: Any, scenario: Scenario, numbers: Sequence[int], *, vehicle: Vehicle,
            effects: Chosen = (),
            without: Sequence[str] = (), seed: int = 0,
            plugins: Sequence[str] = ()) -> Iterator[FlightLog | Diverged]:
    """Fly on the cluster of a dask `Client` and yield flights as they come back, in any order.

    A worker that dies has its flights flown again elsewhere: each comes back once. plugins:
    texts of effect files that the workers register first.
    """
    from dask.distributed import as_completed

    waiting = list(numbers)[::-1]
    call = uuid.uuid4().hex  # a scheduler gives two tasks of one key one result, and another call asks for others

    def send() -> Any:
        number = waiting.pop()
        return client.submit(_fly, scenario, vehicle, seed, number, effects, tuple(without), tuple(plugins),
                             pure=False, retries=3, key=f"airtouch-{call}-{number}")

    with client.as_current():
        running = as_completed([send() for _ in range(min(AHEAD, len(waiting)))])
    for future in running:
        result = future.result()
        future.release()
        if waiting:
            running.add(send())
        yield result


def connect(address: str) -> Any:
    """A client of the scheduler at `address`. Raises AirTouchError if no scheduler answers."""
    try:
        from dask.distributed import Client
    except ImportError:
        raise AirTouchError("--dask needs the extra `scale`: pip install airtouch[scale]") from None
    try:
        return Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise AirTouchError(f"no dask scheduler answers at {address}: {error}") from None


def _fly(scenario: Scenario, vehicle: Vehicle, seed: int, number: int, effects: Chosen,
         without: Sequence[str],
         plugins: Sequence[str]) -> FlightLog | Diverged:
    from airtouch.simulation import effects as registry

    for text in plugins:
        registry.load_text(text)
    return fly(scenario, vehicle, seed, number, effects=effects, without=without)
