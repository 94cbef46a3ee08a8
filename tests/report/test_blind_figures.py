"""The plot of a blind check: its counts and its reliability, as the score has them."""

import numpy as np
import pytest

from airtouch.report.blind_figures import confusion_and_reliability

CONFUSION = {"wind": {"wind": 6, "drag": 2}, "drag": {"unknown": 3}}
RELIABILITY = [{"probability": 0.4, "value": 0.5, "low": 0.2, "high": 0.8, "n": 10},
               {"probability": 0.9, "value": 1.0, "low": 0.7, "high": 1.0, "n": 12}]


@pytest.fixture(scope="module")
def panes():
    """Confusion and reliability."""
    return confusion_and_reliability({"confusion": CONFUSION, "reliability": RELIABILITY}).axes


def test_every_count_stands_at_its_true_effect_and_its_answer(panes):
    ax, _ = panes
    answers, true = ([t.get_text() for t in ticks] for ticks in (ax.get_xticklabels(), ax.get_yticklabels()))
    counts = {(true[round(y)], answers[round(x)]): int(text.get_text())
              for text in ax.texts for x, y in (text.get_position(),)}
    assert counts == {("wind", "wind"): 6, ("wind", "drag"): 2, ("drag", "unknown"): 3}
    shade = ax.images[0].get_array()
    assert shade[true.index("wind"), answers.index("wind")] == 0.75  # 6 of 8
    np.testing.assert_allclose(shade.sum(axis=1), 1.0)
    assert ax.get_xlabel() == "answered first"


def test_every_bin_of_the_probability_has_a_point_with_its_interval_and_its_flights(panes):
    _, ax = panes
    (points, _, (bars,)), = ax.containers
    np.testing.assert_allclose(points.get_xydata(), [(0.4, 0.5), (0.9, 1.0)])
    np.testing.assert_allclose([bar[:, 1] for bar in bars.get_segments()], [(0.2, 0.8), (0.7, 1.0)])
    assert [t.get_text() for t in ax.texts] == ["10", "12"]
    diagonal = next(line for line in ax.get_lines() if line is not points)
    np.testing.assert_allclose(diagonal.get_xdata(), diagonal.get_ydata())
