"""Which of many flights are judged."""

import numpy as np
import pytest

from airtouch.gap.diagnosis import MOST_SECONDS, flights_to_judge


@pytest.mark.parametrize(("count", "seconds", "chosen"), [
    (1, 500.0, [0]), (5, 40.0, [0, 1, 2, 3, 4]), (10, 42.0, [0, 2, 4, 6, 9]), (6, 300.0, [0, 1, 3, 5]),
    (3, 300.0, [0, 1, 2])])
def test_flights_of_210_s_are_judged_and_no_fewer_than_four(count, seconds, chosen):
    flights = [np.full(round(100.0 * seconds), i) for i in range(count)]
    judged = flights_to_judge(flights)
    assert [int(f[0]) for f in judged] == chosen
    assert sum(len(f) for f in judged) * 0.01 <= MOST_SECONDS or len(judged) <= 4
