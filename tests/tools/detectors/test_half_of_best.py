"""How two lists of edges are held against each other, and how a flight is turned, in closed form."""

from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.logs.flight_log import ACC_WORLD
from made_flight import made_flight
from tools.detectors import half_of_best


def edges(*pairs):
    return [SimpleNamespace(kind=kind, sample=sample) for kind, sample in pairs]


@pytest.mark.parametrize(("other", "shift", "same"), [
    ((("entry", 110), ("exit", 310)), 0, True),
    ((("entry", 111), ("exit", 300)), 0, False),  # one sample too far
    ((("entry", 89), ("exit", 299)), 1, True),  # a log that begins one sample later
    ((("exit", 100), ("exit", 300)), 0, False),
    ((("entry", 100),), 0, False)])
def test_edges_are_the_same_within_a_tenth_of_a_second(other, shift, same):
    assert half_of_best.same(edges(("entry", 100), ("exit", 300)), edges(*other), shift) is same


def test_four_quarter_turns_are_none_and_two_turn_forward_into_backward():
    log = made_flight(0)
    rng = np.random.default_rng(0)
    log = log.with_columns({name: rng.normal(size=len(log)) for name in ACC_WORLD})
    half = half_of_best.turn(half_of_best.turn(log))
    x, y, z = ACC_WORLD
    np.testing.assert_array_equal(half[x], -log[x])
    np.testing.assert_array_equal(half[y], -log[y])
    np.testing.assert_array_equal(half[z], log[z])
    quarter = half_of_best.turn(log)
    before, after = (one[x] + 1j * one[y] for one in (log, quarter))
    np.testing.assert_array_equal(after, 1j * before)  # to the left, by a right angle


def test_a_log_without_its_first_sample_begins_at_the_second():
    log = made_flight(0)
    later = half_of_best.without_first_sample(log)
    assert len(later) == len(log) - 1 and later["t_s"][0] == log["t_s"][1]
