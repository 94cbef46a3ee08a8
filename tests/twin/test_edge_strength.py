"""The strength of recorded edges beside simulated ones, where it is known because the edges were made that strong."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.twin import edge_strength, overlay
from airtouch.twin.recorded import missions
from airtouch.twin.recorded.features import height_class
from twin_courses import PLAIN, made_course


@pytest.fixture(scope="module")
def responses(vehicle):
    """Responses at the heights of the made flights, four each, with the same air."""
    return [r for clearance in (0.035, 0.06, 0.09)
            for r in overlay.simulate_responses(missions.scenario_of(made_course(1, clearance), PLAIN),
                    vehicle, 4, seed=4)]


def test_edges_simulated_half_as_strong_are_doubled(sweeps, responses):
    """The made flights are the simulator's own, of other random numbers: their edges are as strong as its edges."""
    logs = [log for _, log, _ in sweeps]
    strengths = edge_strength.strengths(logs, responses, (-9.0, 9.0))
    assert strengths["mid", "entry"] == pytest.approx(1.0, abs=0.4)
    halved = edge_strength.strengths(logs, [replace(r, values=0.5 * r.values) for r in responses], (-9.0, 9.0))
    assert halved == pytest.approx({key: 2.0 * value for key, value in strengths.items()})
    assert edge_strength.strengths(logs, [replace(r, values=0.5 * r.values) for r in responses])["mid", "entry"] > 1.2


def test_a_response_is_scaled_by_its_height_and_kind(responses):
    response = next(r for r in responses if height_class(r.edges[0].height_after_m) == "low")
    entry, leave = (e.sample for e in response.edges)
    strong = edge_strength.scale(response, {("low", "entry"): 2.0, ("low", "exit"): 3.0, ("high", "entry"): 9.0})
    np.testing.assert_allclose(strong.values[:entry + 20], 2.0 * response.values[:entry + 20])
    np.testing.assert_allclose(strong.values[leave - 20:], 3.0 * response.values[leave - 20:])
    assert strong.edges == response.edges
    same = edge_strength.scale(response, {("high", "entry"): 9.0})
    np.testing.assert_array_equal(same.values, response.values)


def test_it_stays_within_bounds_and_needs_flights(sweeps, responses):
    """A platform without air has no strength to copy; two flights of a class are too few to tell."""
    logs = [log for _, log, _ in sweeps]
    tiny = [replace(r, values=0.01 * r.values) for r in responses]
    assert set(edge_strength.strengths(logs, tiny).values()) <= set(edge_strength.BOUNDS)
    assert edge_strength.strengths(logs[:2], responses) == {}
    no_down_range = type(logs[0])({k: v for k, v in logs[0].columns.items() if k != "zrange_m"}, logs[0].meta)
    assert edge_strength.strengths([no_down_range] * 5, responses) == {}


def test_every_class_of_height_comes_as_often(responses):
    of = {height_class(r.edges[0].height_after_m): r for r in responses}
    unbalanced = [of["low"]] * 7 + [of["high"]] * 5
    evened = edge_strength.balance_heights(unbalanced)
    names = [height_class(r.edges[0].height_after_m) for r in evened]
    assert len(evened) == 12 and names.count("low") == names.count("high") == 6
    assert edge_strength.balance_heights([]) == []
