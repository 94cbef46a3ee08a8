"""Few that stand for many."""

from itertools import pairwise

import pytest

from airtouch.gap.flights.evenly import evenly_spaced


@pytest.mark.parametrize(("count", "most"), [(2, 2), (7, 2), (7, 5), (40, 4), (87, 7)])
def test_gaps_between_the_chosen_differ_by_one_at_most_and_both_ends_are_chosen(count, most):
    chosen = evenly_spaced(range(count), most)
    gaps = [b - a for a, b in pairwise(chosen)]
    assert len(chosen) == most and (chosen[0], chosen[-1]) == (0, count - 1)
    assert max(gaps) - min(gaps) <= 1


def test_of_one_it_is_the_first():
    assert evenly_spaced("abc", 1) == ["a"]


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_all_are_chosen_where_there_are_no_more_and_each_once(count):
    assert evenly_spaced(list("abcde")[:count], 5) == list("abcde")[:count]
