"""The problem of a part of flights: flattened once, and nothing that outlives the data."""

import gc
import weakref

import pytest

from airtouch.gap.evidence import problem
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.flattened import flattened
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.problem import BlockSet, problem_of, whole_of
from airtouch.gap.nominal.build_study import declared_study
from airtouch.gap.signals.channels import TORQUE
from airtouch.gap.signals.response import FIRST_BIN
from airtouch.gap.signals.spectra import AIR
from gap_flights import VEHICLE, flight


def test_without_a_response_torque_counts_in_the_means_alone():
    """Of data of any part of the diagnosis: the declared vehicle, the seconds of a known wake."""
    data = Data(declared_study(VEHICLE, ()), [flight(20.0)])
    keep = problem_of(data, whole_of(data)).flat.layout.keep[AIR]
    assert data.means_only and keep[:FIRST_BIN, TORQUE].all() and not keep[FIRST_BIN:, TORQUE].any()


def test_all_blocks_of_some_flights_are_flattened_once(monkeypatch):
    """A long-lived set of flights, judged a thousand times, else kept a thousand copies of them."""
    calls = []
    monkeypatch.setattr(problem, "flattened", lambda data, pieces: calls.append(pieces) or flattened(data, pieces))
    data = Data(declared_study(VEHICLE, ()), [flight(20.0), flight(20.0, name="other")])
    blocks = whole_of(data)
    assert {i for i, _, _ in blocks.pieces} == {0, 1} and all(chosen.all() for _, _, chosen in blocks.pieces)
    assert problem_of(data, whole_of(data)).flat is problem_of(data, blocks).flat
    assert {i for i, _, _ in whole_of(data, [1]).pieces} == {1}
    assert [BlockSet(pieces).key for pieces in calls] == [blocks.key]


@pytest.fixture
def no_collector():
    """What is freed, is freed because nothing refers to it."""
    gc.disable()
    yield
    gc.enable()


def test_data_are_freed_with_their_last_use(no_collector):
    """Thousands of flights are diagnosed one after another: none waits for the garbage collector."""
    data = Data(declared_study(VEHICLE, ()), [flight(20.0)])
    freed = weakref.ref(data)
    problem_of(data, whole_of(data)).residual([])
    judge(data, whole_of(data), ())
    del data
    assert freed() is None
