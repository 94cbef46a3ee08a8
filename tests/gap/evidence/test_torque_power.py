"""Power that effects of the loop add to the floor of the torque: where there is any, and where there is none."""

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.evidence.torque_power import beside_edges, loops_differ
from airtouch.gap.signatures.signature import signature_of
from airtouch.simulation.effects import EFFECTS, Active, get
from gap_flights import fly
from hovers import FLOOR, hover


def active(name, **values):
    effect = get(name)
    return Active(effect, effect.scaled(effect.values(), 0.0) | values)


LATE, HEAVY = active("sensor_latency", delay=0.003), active("mass", fraction=0.1)


@pytest.fixture(scope="module")
def problem(study):
    data = Data(study, fly(1, 71))
    return problem_of(data, whole_of(data))


def test_another_loop_changes_the_power_of_the_torque_alone(problem):
    added, is_torque = problem.torque_power([LATE]), problem.flat.is_torque
    assert np.abs(added[is_torque]).max() > 0.0 and not added[~is_torque].any()
    assert (problem.elements.power[:len(added)] + added > 0.0).all(), "a loop can take away no more than there is"


def test_what_leaves_the_loop_adds_no_power(problem):
    assert not problem.torque_power([]).any() and not problem.torque_power([HEAVY]).any()
    np.testing.assert_array_equal(problem.torque_power([LATE, HEAVY])[~problem.flat.is_torque], 0.0)


def test_without_a_loop_nothing_is_known_of_it():
    data = Data(FLOOR, [hover(1, length_s=8.0)])
    problem = problem_of(data, whole_of(data))
    assert not problem.torque_power([LATE]).any() and len(problem.torque_power([LATE])) == problem.flat.replay_count
    assert not loops_differ(data, [], [LATE])


def test_loops_differ_by_effects_that_change_them(problem):
    assert loops_differ(problem.data, [], [LATE]) and not loops_differ(problem.data, [], [HEAVY])
    assert not loops_differ(problem.data, [LATE], [LATE, HEAVY])


def test_effects_that_show_at_edges_alone_are_left_to_these():
    at_edges = [Active(e, e.values()) for e in EFFECTS.values() if signature_of(e).edges_only]
    assert at_edges and beside_edges([LATE, *at_edges, HEAVY]) == [LATE, HEAVY]
