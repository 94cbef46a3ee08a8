"""A cell in words: its gap and the ends of its interval can be told apart."""

from dataclasses import replace

import pytest

from airtouch.gap.where.cell_words import gap, interval
from made_diagnosis import cell

CELL = cell("force_x", "hover", 1.0)


@pytest.mark.parametrize(("low", "value", "high", "words"), [
    (2.098, 2.113, 2.128, "2.11 (2.10 to 2.13)"),
    (1.7, 2.1, 2.7, "2.1 (1.7 to 2.7)"),
    (23.1, 23.4, 24.2, "23 (23 to 24)"),
    (123.21, 123.24, 123.31, "123.2 (123.2 to 123.3)"),
    (0.012341, 0.012343, 0.012346, "0.01234 (0.01234 to 0.01235)"),
    (0.5, 0.5, 0.5, "0.5 (0.5 to 0.5)")])
def test_a_gap_has_as_many_digits_as_tell_the_ends_of_its_interval_apart(low, value, high, words):
    written = replace(CELL, low=low, gap=value, high=high)
    assert f"{gap(written)} ({interval(written)})" == words


def test_a_gap_without_an_interval_has_two_digits():
    written = replace(CELL, gap=2.113, low=None, high=None)
    assert (gap(written), interval(written)) == ("2.1", "")
