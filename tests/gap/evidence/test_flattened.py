"""Blocks flattened: what is known of each value, and what an offset of one flight adds, against data made with it."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.evidence.cells import SENSOR_AXES
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.flattened import FREEDOM_OF_BLOCK, LEAST_FREEDOM, OFFSETS, Offset
from airtouch.gap.evidence.likelihood import REPLAY_FREEDOM
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.signals.channels import COUNT, TORQUE
from airtouch.gap.signals.spectra import AIR, REST
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
    channels = [{int(c) for c in flat.elements.channel[o.places]} for o in flat.offsets]
    flights = [{int(f) for f in flat.elements.flight[o.places]} for o in flat.offsets]
    assert channels == [{0}, {2}, {4}] * 2 and flights == [{0}] * 3 + [{1}] * 3
    assert [o.spread for o in flat.offsets] == [0.1, 0.2, 0.5] * 2


def test_a_unit_offset_is_what_a_constant_force_adds_in_the_air(two):
    """1 m/s^2 forward on the first flight, which begins at rest on the ground."""
    first_flight = two[0]
    forward = (~first_flight.on_ground)[:, None] * [1.0, 0.0, 0.0]
    moved = replace(first_flight, acceleration=first_flight.acceleration + forward)
    before, after = flat_of(two), flat_of([moved, two[1]])
    offset = before.offsets[0]
    added = np.zeros(len(before.elements.base), complex)
    added[offset.places] = offset.column
    np.testing.assert_allclose(after.elements.base - before.elements.base, added, atol=1e-9)


def test_an_offset_at_other_places_is_nothing_where_it_changes_nothing():
    offset = Offset(np.array([2, 5, 9]), np.array([1.0, 2.0j, 3.0]), 0.1)
    np.testing.assert_array_equal(offset.at(np.array([0, 5, 6, 9])), [0.0, 2.0j, 0.0, 3.0])
    np.testing.assert_array_equal(offset.at(np.array([5, 2])), [2.0j, 1.0])
    assert not offset.at(np.array([1, 3])).any() and not len(offset.at(np.zeros(0, int)))


@pytest.mark.parametrize("blocks", [0, 2, 100])
def test_freedom_is_three_a_block_within_its_limits(blocks):
    study = replace(FLOOR, floor=replace(FLOOR.floor, block_counts={AIR: blocks, REST: blocks}))
    freedom = flat_of([hover(1, length_s=10.0)], study).elements.freedom
    assert set(freedom) == {min(max(FREEDOM_OF_BLOCK * blocks, LEAST_FREEDOM), REPLAY_FREEDOM)}


def test_torque_and_blocks_of_the_values(two):
    """Axis by axis a bin of a block has each channel once; only blocks in the air are numbered."""
    flat = flat_of(two)
    channel = flat.elements.channel[:flat.replay_count]
    np.testing.assert_array_equal(flat.is_torque, (channel >= TORQUE.start) & (channel < TORQUE.stop))
    assert (channel[:SENSOR_AXES] == np.arange(SENSOR_AXES)).all()
    on_ground = flat.air.block_of_value < 0
    assert on_ground.any() and (flat.elements.flight[:flat.replay_count][on_ground] == 0).all()
    assert len(flat.air.begin) == flat.air.block_of_value.max() + 1
