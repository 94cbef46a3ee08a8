"""Power that effects of the loop add to the floor of the torque: how much, where there is any, and where none."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.layout import Layout
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.evidence.torque_power import beside_edges, extra_torque_power, loops_differ
from airtouch.gap.loop.torque_share import Change
from airtouch.gap.signals.channels import COUNT, TORQUE
from airtouch.gap.signals.response import FIRST_BIN
from airtouch.gap.signals.spectra import AIR, REST, frequencies
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
    added, is_torque = problem.extra_torque_power([LATE]), problem.flat.is_torque
    assert np.abs(added[is_torque]).max() > 0.0 and not added[~is_torque].any()
    assert (problem.elements.floor_power[:len(added)] + added > 0.0).all(), "a loop can take away no more than there is"


@pytest.mark.parametrize(("part", "grown", "added"), [
    (0.5, 3.0, 1.0), (1.0, 2.0, 1.0), (2.0, 3.0, 2.0), (0.5, 0.2, -0.4)])
def test_that_part_of_the_floor_grows_which_the_loop_makes(part, grown, added):
    """Of noise of the loop that is `part` of the floor and grows so many times, part (grown - 1) is added.

    No more than the floor can be noise of the loop, whatever its model says. The gap itself stays as it is.
    """
    data = Data(FLOOR, [hover(1, length_s=12.0)])
    every_bin = {state: np.ones((len(frequencies(state)), COUNT), bool) for state in (AIR, REST)}
    layout = Layout(whole_of(data).pieces, every_bin)  # without a response torque counts in its means alone
    channel, residual = layout.channels(), layout.gather(data.residual)
    is_torque = (channel >= TORQUE.start) & (channel < TORQUE.stop)
    flat = SimpleNamespace(
        layout=layout, replay_count=len(residual),
        elements=SimpleNamespace(residual=residual, valid=np.isfinite(residual)),
        noise=np.random.default_rng(2).uniform(1.0, 2.0, len(residual)), is_torque=is_torque)
    floor = FLOOR.floor.power[AIR][:, TORQUE]
    one = np.ones((2, *floor.shape))
    before = part * floor
    change = Change(one[0, :, :1], one, one, 0.0 * one[0], one[0, :, :1], np.stack([before, grown * before]))
    loop = SimpleNamespace(torque_change=lambda active, f: change if active else None)
    with_loop = Data(replace(FLOOR, loop=loop), data.flights)
    per_bin = np.zeros((len(floor), COUNT))
    per_bin[FIRST_BIN:, TORQUE] = added
    expected = flat.noise * layout.per_bin({AIR: per_bin, REST: np.zeros(every_bin[REST].shape)})
    np.testing.assert_allclose(extra_torque_power(with_loop, flat, [LATE]), expected, atol=1e-12 * flat.noise.max())
    assert (expected != 0.0).any() and not expected[~is_torque].any()


def test_what_leaves_the_loop_adds_no_power(problem):
    assert not problem.extra_torque_power([]).any() and not problem.extra_torque_power([HEAVY]).any()
    np.testing.assert_array_equal(problem.extra_torque_power([LATE, HEAVY])[~problem.flat.is_torque], 0.0)


def test_without_a_loop_nothing_is_known_of_it():
    data = Data(FLOOR, [hover(1, length_s=8.0)])
    problem = problem_of(data, whole_of(data))
    extra = problem.extra_torque_power([LATE])
    assert not extra.any() and len(extra) == problem.flat.replay_count
    assert not loops_differ(data, [], [LATE])


def test_loops_differ_by_effects_that_change_them(problem):
    assert loops_differ(problem.data, [], [LATE]) and not loops_differ(problem.data, [], [HEAVY])
    assert not loops_differ(problem.data, [LATE], [LATE, HEAVY])


def test_effects_that_show_at_edges_alone_are_left_to_these():
    at_edges = [Active(e, e.values()) for e in EFFECTS.values() if signature_of(e).edges_only]
    assert at_edges and beside_edges([LATE, *at_edges, HEAVY]) == [LATE, HEAVY]
