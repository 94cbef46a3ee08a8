"""Intervals of blocks against all that there are, and bursts in made forces."""

from dataclasses import replace
from itertools import combinations_with_replacement

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.passing import gate_search
from airtouch.gap.passing.bursts import FORCE_BURSTS, burst_gate
from airtouch.gap.passing.gate_search import MOST_INTERVALS, STEPS_S, best_intervals, interval_cost
from airtouch.gap.result import NamedEffect, Quantity
from airtouch.gap.signatures.candidates import term_of
from hovers import FLOOR, hover


@pytest.mark.parametrize("seed", range(5))
def test_the_best_interval_is_the_best_of_all_within_one_flight(seed):
    rng = np.random.default_rng(seed)
    gain, flight = rng.normal(size=20), np.repeat([0, 1], [12, 8])
    sums = {(a, b): gain[a:b + 1].sum() for a, b in combinations_with_replacement(range(20), 2)
            if flight[a] == flight[b]}
    best = max(sums, key=lambda s: sums[s])
    found = best_intervals(gain, flight, 0.99 * sums[best])
    assert best in found and best_intervals(gain, flight, 1.01 * sums[best]) == []


def test_intervals_do_not_overlap_and_each_is_worth_its_cost():
    gain = np.array([5.0, -1.0, 5.0, -20.0, 3.0, -20.0, 6.0])
    assert best_intervals(gain, np.zeros(7, int), 4.0) == [(0, 2), (6, 6)]
    assert best_intervals(gain, np.array([0, 0, 1, 1, 1, 1, 1]), 4.0) == [(0, 0), (2, 2), (6, 6)]


def test_a_flight_has_no_more_than_so_many_intervals():
    gain = np.tile([10.0, -50.0], 10)
    assert best_intervals(gain, np.zeros(20, int), 1.0) == [(2 * k, 2 * k) for k in range(MOST_INTERVALS)]
    assert len(best_intervals(gain, np.repeat([0, 1], 10), 1.0)) == 2 * MOST_INTERVALS


@pytest.mark.parametrize("other", ["a.csv", "b.csv"])
def test_moved_ends_stop_at_the_next_interval_of_the_flight(monkeypatch, other):
    """Where an effect explains every second of two flights, its intervals grow until they meet."""
    push = term_of(NamedEffect("wind", {"x": Quantity(0.3)}))
    monkeypatch.setattr(gate_search, "judge", lambda _data, _blocks, terms: seconds_in(terms[0].gate))
    first, second = gate_search._sharpen(None, None, [push], (("a.csv", 2.0, 5.0), (other, 5.3, 9.0)))
    assert first[1] < 2.0 and second[2] > 9.0
    if other == "a.csv":
        assert 5.0 < first[2] <= second[1] < first[2] + STEPS_S[-1]
    else:
        assert first[2] > 5.3 and second[1] < 5.0


def seconds_in(gate):
    """Seconds of all flights within a gate, to 10 ms."""
    return 0.01 * len({(name, k) for name, since, until in gate for k in range(round(100 * since), round(100 * until))})


def shaken(since_s, until_s, factor):
    """A hover whose force along the thrust is livelier for some seconds."""
    flight = hover(3)
    t = np.arange(len(flight)) * PERIOD_S
    force = flight.acceleration.copy()
    mean = force[:, 2].mean()
    acts = (t >= since_s) & (t < until_s)
    force[acts, 2] = mean + factor * (force[acts, 2] - mean)
    return replace(flight, acceleration=force, name="shaken")


def test_a_burst_is_found_in_its_seconds_and_costs_the_choice_of_its_ends():
    gate, cost = burst_gate(Data(FLOOR, [shaken(12.0, 14.0, 5.0)]), FORCE_BURSTS)
    (name, since, until), = gate
    assert name == "shaken"
    assert (since, until) == pytest.approx((12.0, 14.0), abs=FORCE_BURSTS.piece_s)
    assert cost == pytest.approx(interval_cost(int(30.0 / FORCE_BURSTS.piece_s)))


@pytest.mark.parametrize("factor", [1.0, 0.2, 0.5 * np.sqrt(FORCE_BURSTS.burst_ratio)])
def test_a_calm_or_hardly_livelier_interval_is_no_burst(factor):
    assert burst_gate(Data(FLOOR, [shaken(12.0, 14.0, factor)]), FORCE_BURSTS) == ((), 0.0)
