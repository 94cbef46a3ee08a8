"""What is shared with a second process is what one process gives, whichever of the two did it."""

import multiprocessing
import os
import sys
import threading
import time

import pytest

from airtouch.gap import second_process
from airtouch.gap.second_process import map_on_two_cores, spare_core
from airtouch.simulation import effects

forks = pytest.mark.skipif(not spare_core(), reason="one core, or a platform that does not fork safely")


@pytest.fixture(autouse=True)
def forking(monkeypatch):
    """Here a diagnosis forks whoever runs beside it."""
    monkeypatch.setattr(second_process, "spare_core", spare_core)


def _slow(x):
    import time

    time.sleep(0.02)
    return x, os.getpid()


@forks
def test_both_processes_work_and_the_order_stays():
    results = map_on_two_cores(_slow, range(20))
    assert [x for x, _ in results] == list(range(20))
    assert len({pid for _, pid in results}) == 2
    assert not multiprocessing.active_children()


@forks
def test_what_a_dead_process_owes_is_done_here():
    parent = os.getpid()

    def dies_elsewhere(x):
        if os.getpid() != parent:
            os._exit(1)
        return _slow(x)[0]

    assert map_on_two_cores(dies_elsewhere, range(8)) == list(range(8))


@forks
def test_what_a_process_owes_that_dies_while_it_sends_is_done_here():
    """A message larger than a pipe holds: the other process waits for a reader when it is ended."""
    parent = os.getpid()

    def large(x):
        if os.getpid() != parent:
            threading.Timer(0.5, os._exit, (1,)).start()
            return bytes(4_000_000)
        time.sleep(2.0)
        return b"here"

    assert map_on_two_cores(large, range(2)) == [b"here"] * 2


@forks
def test_an_error_of_the_other_process_is_raised_here():
    parent = os.getpid()

    def fails(x):
        """The parent is busy with the first item until the other process has taken the second."""
        if os.getpid() == parent and x == 0:
            time.sleep(1.0)
        if x == 1:
            raise ValueError(f"item {x}")
        return x

    with pytest.raises(ValueError, match="item 1"):
        map_on_two_cores(fails, range(2))
    assert not multiprocessing.active_children()


@forks
def test_effects_come_back_as_the_registered_ones():
    names = ["wind", "mass", "downwash", "inertia"]

    def effect(name):
        return _slow(effects.get(name))[0]

    assert all(e is effects.get(n) for n, e in zip(names, map_on_two_cores(effect, names), strict=True))


def test_one_core_forks_nothing(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0}, raising=False)
    assert not spare_core()
    assert {pid for _, pid in map_on_two_cores(_slow, range(4))} == {os.getpid()}


@pytest.mark.skipif(sys.platform != "linux", reason="forks on Linux alone")
def test_a_worker_of_a_pool_forks_nothing():
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply(second_process.spare_core) is False
