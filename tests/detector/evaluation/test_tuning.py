"""Choice of thresholds and lag on constructed flights."""

from collections import namedtuple

import pytest

from airtouch.detector.evaluation.tuning import choose, lag, timed_f1
from airtouch.detector.trace import Detection

True_ = namedtuple("True_", "sample kind")
EDGES = [True_(1000, "entry"), True_(1400, "exit")]


def at(*samples):
    return [Detection(s, "edge") for s in samples]


def test_lag_is_the_median_delay_and_late_is_positive():
    assert lag([(EDGES, at(1010, 1430)), (EDGES, at(1020))]) == pytest.approx(0.2)
    assert lag([(EDGES, at())]) == 0.0 and lag([(EDGES, at())], 0.4) == 0.4


def test_timed_f1_by_hand():
    assert timed_f1([(EDGES, at(1000, 1400))]) == 1.0
    assert timed_f1([(EDGES, at(1030, 1430))], lag_s=0.3) == pytest.approx(1.0)
    assert timed_f1([(EDGES, at(1075))]) == pytest.approx(2 * 0.5 / 3)
    assert timed_f1([(EDGES, at())]) == 0.0


def test_the_best_candidate_with_its_lag():
    detections = {"late": at(1030, 1430), "many": at(1000, 1400, 500, 600), "none": at()}
    choice = choose(detections, [EDGES], lambda name, _: detections[name])
    assert choice == ("late", pytest.approx(0.3), pytest.approx(1.0))
