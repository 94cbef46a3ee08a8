"""A scenario's values: arithmetic against Python's own, draws against the bounds of their ranges, errors by place."""

import math

import numpy as np
import pytest
from scipy.stats import kstest

from airtouch.errors import AirTouchError
from airtouch.simulation.flight_plan.expressions import draw, evaluate

VALUES = {"a": 3.0, "height": 0.04}


@pytest.mark.parametrize("text, true", [
    ("1 + 2 * 3", 7.0), ("(1 + 2) * 3", 9.0), ("-a / 2", -1.5), ("a - -a", 6.0), ("height * 100", 4.0),
    ("sin(30)", 0.5), ("a * cos(60)", 1.5), ("max(a, 2, 5)", 5.0), ("min(a, height)", 0.04),
    ("sin(a + 42)", math.sqrt(0.5))])
def test_an_expression_has_the_value_of_its_arithmetic(text, true):
    assert evaluate(text, VALUES, "here") == pytest.approx(true)


@pytest.mark.parametrize("text, message", [
    ("b + 1", "uses 'b'"), ("1 +", "not a sum"), ("a / 0", "not a sum"), ("__import__('os')", "not a sum"),
    ("a.real", "not a sum"), ("'text'", "not a sum"), ("True", "not a sum"), ("a ** 2", "not a sum"),
    ("max()", "not a sum"), ("max(1, 2, key=50)", "not a sum")])
def test_anything_else_is_refused_by_its_place(text, message):
    with pytest.raises(AirTouchError, match=f"^here: .*{message}"):
        evaluate(text, VALUES, "here")


def test_a_range_is_drawn_evenly_and_lists_element_by_element():
    rng = np.random.default_rng(1)
    node = {"place": [{"low": -1.0, "high": 3.0}, "= a + 1"], "kind": {"choice": ["wood", "foam"]}, "n": 2}
    draws = [draw(node, VALUES, rng, "here") for _ in range(2000)]
    assert kstest([d["place"][0] for d in draws], "uniform", args=(-1.0, 4.0)).pvalue > 0.01
    assert all(d["place"][1] == 4.0 and d["n"] == 2 for d in draws)
    wood = sum(d["kind"] == "wood" for d in draws)
    assert abs(wood - 1000) < 4 * math.sqrt(500)  # four standard deviations of a fair coin


@pytest.mark.parametrize("node, message", [
    ({"low": 2.0, "high": 1.0}, "low <= high"), ({"low": "x", "high": 1.0}, "two numbers"),
    ({"low": True, "high": 2.0}, "two numbers"), ({"choice": []}, "needs a list"), ({"choice": 3}, "needs a list")])
def test_wrong_ranges_are_told(node, message):
    with pytest.raises(AirTouchError, match=f"^here.top: .*{message}"):
        draw({"top": node}, VALUES, np.random.default_rng(0), "here")
