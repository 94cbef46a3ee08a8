"""Bootstrap intervals against the normal theory and against repeated experiments."""

import numpy as np
import pytest

from airtouch.detector.evaluation.bootstrap import bootstrap, resampled


def mean_of(sums):
    with np.errstate(invalid="ignore", divide="ignore"):
        return {"mean": np.asarray(sums["x"]) / np.asarray(sums["n"])}


def test_interval_of_a_mean_agrees_with_the_normal_one():
    x = np.random.default_rng(1).normal(3.0, 2.0, 400)
    low, high = bootstrap({"x": x, "n": np.ones(400)}, mean_of, replicates=4000)["mean"]
    half = 1.96 * x.std() / np.sqrt(400)
    assert low == pytest.approx(x.mean() - half, abs=0.03)
    assert high == pytest.approx(x.mean() + half, abs=0.03)


def test_interval_covers_the_truth_as_often_as_it_says():
    rng = np.random.default_rng(2)
    covered = 0
    for seed in range(300):
        x = rng.exponential(1.0, 60)
        low, high = bootstrap({"x": x, "n": np.ones(60)}, mean_of, replicates=400, seed=seed)["mean"]
        covered += low <= 1.0 <= high
    assert 0.87 <= covered / 300 <= 0.98


def test_flights_are_drawn_whole():
    # two flights that disagree: an interval by sample would be narrow, by flight it spans both
    table = {"x": np.array([0.0, 1000.0]), "n": np.array([1000.0, 1000.0])}
    assert bootstrap(table, mean_of)["mean"] == pytest.approx((0.0, 1.0))


def test_one_flight_has_no_interval():
    assert bootstrap({"x": np.ones(1), "n": np.ones(1)}, mean_of) == {"mean": None}
    assert bootstrap({"x": np.ones(3), "n": np.zeros(3)}, mean_of) == {"mean": None}


def test_interval_of_a_statistic_of_cases_agrees_with_the_normal_one():
    x, y = np.random.default_rng(1).normal((3.0, 1.0), 2.0, (400, 2)).T
    low, high = resampled(lambda i, k: x[i].mean() - y[k].mean(), 400, 400, replicates=2000, level=0.9)
    half = 1.645 * np.hypot(x.std(), y.std()) / np.sqrt(400)
    assert (low, high) == pytest.approx((x.mean() - y.mean() - half, x.mean() - y.mean() + half), abs=0.03)


def test_several_statistics_have_an_interval_each_and_nan_is_left_out():
    x = np.array([[1.0, 5.0], [2.0, 5.0], [np.nan, 5.0]])
    low, high = resampled(lambda i: x[i].mean(axis=0), 3, replicates=500, level=1.0)
    assert low.tolist() == [1.0, 5.0] and high.tolist() == [2.0, 5.0]
