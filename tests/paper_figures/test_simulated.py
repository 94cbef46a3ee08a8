"""Crossings and labels by place, on flights whose path is known."""

import numpy as np
import pytest

from airtouch.logs.edges import Edge, true_edges
from airtouch.logs.flight_log import FlightLog
from airtouch.paper_figures import simulated
from airtouch.simulation.flight_plan import world


def test_a_crossing_by_place_is_where_the_drone_passes_the_outline():
    corners = np.array([[1.0, -1.0], [2.0, -1.0], [2.0, 1.0], [1.0, 1.0]])
    x = np.linspace(0.0, 3.0, 301)
    inside = world.inside(corners, x, np.zeros(301))
    assert x[inside].min() == pytest.approx(1.0) and x[inside].max() == pytest.approx(2.0)
    assert not world.inside(corners, x, np.full(301, 1.5)).any()


def test_labels_by_place_are_a_step_of_the_down_range_and_nothing_else():
    n = 900
    log = FlightLog({"t_s": 0.01 * np.arange(n), "zrange_m": np.full(n, 0.04), **{f"m{i}_pwm": np.full(n, 4e4)
                                                                             for i in range(1, 5)}},
                    {"source": "made", "sample_period_s": 0.01})
    labelled = simulated.with_truth(log, lambda _: [Edge(300, "entry", 0, 0), Edge(500, "exit", 0, 0)])
    assert [(e.sample, e.kind) for e in true_edges(labelled)] == [(300, "entry"), (500, "exit")]
    assert all(np.array_equal(labelled[c], log[c]) for c in log.columns if c != "zrange_m")
