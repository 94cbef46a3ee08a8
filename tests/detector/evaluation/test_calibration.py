"""Reliability and ECE where the answer is known."""

import numpy as np
import pytest

from airtouch.detector.evaluation.calibration import expected_calibration_error, reliability


def test_a_probability_that_is_right_has_no_error():
    rng = np.random.default_rng(0)
    p = rng.uniform(0, 1, 200_000)
    assert expected_calibration_error(reliability(p, rng.uniform(0, 1, len(p)) < p)) < 0.01


def test_always_sure_and_half_right_is_wrong_by_a_half():
    table = reliability(np.ones(1000), np.arange(1000) % 2 == 0)
    assert expected_calibration_error(table) == pytest.approx(0.5)
    assert table[9].tolist() == [1000, 1000, 500]


def test_unknown_samples_are_left_out_and_tables_add():
    p, y = np.array([0.05, np.nan, 0.35, 1.0]), np.array([False, True, True, True])
    table = reliability(p, y)
    assert table[:, 0].tolist() == [1, 0, 0, 1, 0, 0, 0, 0, 0, 1]
    assert np.array_equal(reliability(p[:2], y[:2]) + reliability(p[2:], y[2:]), table)


def test_nothing_to_judge_is_nan():
    assert np.isnan(expected_calibration_error(np.zeros((10, 3))))
