"""Blocks flattened: what is known of each value, and what an offset of one flight adds, against data made with it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.flattened import OFFSETS, Offset, _counted
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.signals.channels import CHANNELS, COUNT, TORQUE
from airtouch.gap.signals.response import FIRST_BIN
from airtouch.gap.signals.spectra import AIR, REST, frequencies
from hovers import FLOOR, hover

SPREAD = np.zeros(COUNT)
SPREAD[:OFFSETS] = (0.1, 0.0, 0.2, 0.0, 0.5, 0.0)  #: of the channels force x, force z, torque y
DIFFERING = replace(FLOOR, floor=replace(FLOOR.floor, offset=SPREAD))


def flat_of(flights, study=DIFFERING):
    data = Data(study, flights)
    return problem_of(data, whole_of(data)).flat


@pytest.fixture(scope="module")
def two():
    return [hover(1, length_s=12.0, resting_s=3.0), hover(2, length_s=10.0, name="other")]


def test_offsets_are_of_the_channels_that_differ_in_each_flight(two):
    flat = flat_of(two)
    channels = [{int(c) for c in flat.elements.channel[o.indices]} for o in flat.offsets]
    flights = [{int(f) for f in flat.elements.flight[o.indices]} for o in flat.offsets]
    assert channels == [{0}, {2}, {4}] * 2 and flights == [{0}] * 3 + [{1}] * 3
    assert [o.prior_std for o in flat.offsets] == [0.1, 0.2, 0.5] * 2


def test_a_unit_offset_is_what_a_constant_force_adds_in_the_air(two):
    """1 m/s^2 forward on the first flight, which begins at rest on the ground."""
    first_flight = two[0]
    forward = (~first_flight.on_ground)[:, None] * [1.0, 0.0, 0.0]
    moved = replace(first_flight, acceleration=first_flight.acceleration + forward)
    before, after = flat_of(two), flat_of([moved, two[1]])
    offset = before.offsets[0]
    added = np.zeros(len(before.elements.residual), complex)
    added[offset.indices] = offset.column
    np.testing.assert_allclose(after.elements.residual - before.elements.residual, added, atol=1e-9)


def test_an_offset_at_other_places_is_nothing_where_it_changes_nothing():
    offset = Offset(np.array([2, 5, 9]), np.array([1.0, 2.0j, 3.0]), 0.1)
    np.testing.assert_array_equal(offset.at(np.array([0, 5, 6, 9])), [0.0, 2.0j, 0.0, 3.0])
    np.testing.assert_array_equal(offset.at(np.array([5, 2])), [2.0j, 1.0])
    assert not offset.at(np.array([1, 3])).any() and not len(offset.at(np.zeros(0, int)))


@pytest.mark.parametrize(("blocks", "freedom"), [(0, 2.0), (2, 6.0), (3, 9.0), (100, 12.0)])
def test_freedom_is_three_a_block_from_two_to_twelve(blocks, freedom):
    study = replace(FLOOR, floor=replace(FLOOR.floor, block_counts={AIR: blocks, REST: 100}))
    flat = flat_of([hover(1, length_s=10.0, resting_s=3.0)], study)
    in_air = flat.air.block_of_value >= 0
    assert set(flat.elements.freedom[in_air]) == {freedom} and set(flat.elements.freedom[~in_air]) == {12.0}


def test_an_angular_acceleration_changes_the_values_of_the_torque_alone(two):
    """A yaw rate that grows faster and faster, which no force shows."""
    turned = replace(two[0], rates=two[0].rates + np.arange(len(two[0]))[:, None] ** 3 * [0.0, 0.0, 1e-9])
    before, after = flat_of(two), flat_of([turned, two[1]])
    changed = np.abs(after.elements.residual - before.elements.residual)[:before.replay_count] > 1e-6
    names = np.array([c.name for c in CHANNELS])[before.elements.channel[:before.replay_count]]
    in_air = before.air.block_of_value >= 0
    assert set(names[changed & in_air]) == set(names[before.is_torque & changed]) == {"torque_z"}
    assert set(names[before.is_torque]) == {"torque_x", "torque_y", "torque_z"}


def test_blocks_in_the_air_are_those_that_fit_into_its_seconds(two):
    """Blocks of 2.56 s, each 1.28 s after the one before: six in 9 s of the first flight, six in 10 s of the second."""
    air = flat_of(two).air
    assert air.begin.tolist() == [300 + 128 * k for k in range(6)] + [128 * k for k in range(6)]
    assert air.flight.tolist() == [0] * 6 + [1] * 6
    values, = {int(n) for n in np.bincount(air.block_of_value[air.block_of_value >= 0])}
    assert values == (len(frequencies(AIR)) * 3 + 2 * 3 + 2), "all bins of force; torque's means; roll and pitch rate's"


@pytest.mark.parametrize(("nats", "same_models", "torque_counts"), [
    (0.0, False, True), (20.0, True, True), (20.0, False, False)])
def test_torque_that_the_gyro_may_make_does_not_count_where_its_noise_has_another_echo(
        monkeypatch, nats, same_models, torque_counts):
    """Here the gyro may make all torque above the means; force and means count in any case."""
    above_means = np.zeros((len(frequencies(AIR)), 3), bool)
    above_means[FIRST_BIN:] = True
    response = SimpleNamespace(may_be_gyro=above_means)
    data = SimpleNamespace(study=SimpleNamespace(response=response, same_models=same_models))
    monkeypatch.setattr("airtouch.gap.evidence.flattened.changed_echo_nats", lambda _: nats)
    keep = _counted(data)[AIR]
    assert keep[FIRST_BIN:, TORQUE].any() == torque_counts
    assert keep[0, TORQUE].all() and keep[FIRST_BIN:, :TORQUE.start].any()
