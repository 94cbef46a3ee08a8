"""How much larger the errors of an int8 network are: its mean and interval over flights, where both are known."""

import numpy as np
import pytest

pytest.importorskip("unicorn")
from airtouch.detector.evaluation.data.dataset import Condition
from airtouch.detector.evaluation.score import EdgeScore, FlightScore
from tools.instruction_counts import gap8_figures


def flight(name, *errors_m):
    edges = tuple(EdgeScore("entry", 100 * i, error_m=e) for i, e in enumerate(errors_m))
    return FlightScore(name, Condition(), edges, (), len(edges), 30.0)


def test_signs_and_edges_that_one_misses_do_not_count():
    exact = [flight("b", 0.05, -0.02, 0.1), flight("a", 0.03)]
    scores = [flight("a", -0.04), flight("b", -0.06, 0.03, None)]
    mean, low, high, edges = gap8_figures.more_error(scores, exact)
    assert edges == 3 and (mean, low, high) == pytest.approx((0.01, 0.01, 0.01))


def test_the_interval_is_over_flights():
    """100 flights whose four edges share one difference: the interval is that of a mean of 100, not of 400."""
    more = np.random.default_rng(1).normal(0.0, 0.01, 100)
    exact = [flight(str(i), *[0.5] * 4) for i in range(100)]
    scores = [flight(str(i), *[0.5 + d] * 4) for i, d in enumerate(more)]
    mean, low, high, edges = gap8_figures.more_error(scores, exact)
    half = 1.96 * more.std() / 10.0
    assert edges == 400 and (mean, low, high) == pytest.approx((more.mean(), more.mean() - half, more.mean() + half),
                                                               abs=0.15 * half)
