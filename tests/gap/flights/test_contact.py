"""Moments of contact, in signals whose knocks and take-offs are made."""

import numpy as np
import pytest

from airtouch.gap.flights.clock import PERIOD_S
from airtouch.gap.flights.contact import (
    CONTACT_S,
    SETTLED_S,
    SHORT_STAND_S,
    TOUCH_S,
    jolts,
    knocks,
    near_ground,
    standing,
    within,
)

N = 1000
NOISE = np.random.default_rng(0).normal(size=(N, 3))
AROUND = int(CONTACT_S / PERIOD_S)


def test_within_reaches_as_far_before_as_after():
    samples = np.zeros(50, bool)
    samples[20] = True
    assert np.flatnonzero(within(samples, 0.05)).tolist() == list(range(15, 26))


def test_a_knock_is_far_off_the_other_samples_at_rest():
    force, rest = NOISE.copy(), np.arange(N) < 600
    force[300] += 20.0
    force[800] += 20.0  # in flight: no knock
    assert np.flatnonzero(knocks(force, rest)).tolist() == [300]
    assert not knocks(force, np.zeros(N, bool)).any()


def test_a_collision_takes_the_samples_around_it_and_a_flight_full_of_them_has_none():
    force, air = NOISE.copy(), np.ones(N, bool)
    force[500] += 100.0
    assert np.flatnonzero(jolts(force, None, air)).tolist() == list(range(500 - AROUND, 501 + AROUND))
    force[50::40] += 100.0
    assert not jolts(force, None, air).any()


def test_two_collisions_in_a_short_flight_are_two():
    """In 4 s in the air, of which the seconds around them are a third; each lasts for 30 ms."""
    force, air = NOISE[:500].copy(), np.arange(500) >= 100
    at = [slice(200, 203), slice(400, 403)]
    for hit in at:
        force[hit] += 100.0
    touched = jolts(force, None, air)
    assert all(touched[hit].all() for hit in at) and touched.sum() == 2 * (3 + 2 * AROUND)


def test_legs_may_touch_around_take_off_and_landing_but_not_at_rest_before():
    """Rest, motors on the ground for 1 s, flight, motors on the ground for 1 s, rest."""
    sample = np.arange(N)
    running = (sample >= 200) & (sample < 800)
    ground = (sample < 300) | (sample >= 700)
    touching = near_ground(ground, running)
    assert touching[200:300 + AROUND - 1].all() and not touching[:198].any()
    assert not touching[300 + AROUND:700 - AROUND - 1].any()
    settled = 800 + int(SETTLED_S / PERIOD_S)
    assert touching[700 - AROUND:settled - 1].all() and not touching[settled:].any()


@pytest.mark.parametrize("at_rest_m", [0.012, 0.0, 1.0, None])
def test_a_vehicle_stands_until_it_lifts_off_and_from_its_touch_down_on(at_rest_m):
    """Motors from 1 to 9 s, in the air from 3 to 7 s, low over a platform from 5 to 5.4 s; None: the log shows no rest.

    Before, it stands on the ground, or is held in a hand 1 m high.
    """
    sample, legs_m = np.arange(N), 0.012 if at_rest_m in (None, 1.0) else at_rest_m
    running = np.ones(N, bool) if at_rest_m is None else (sample >= 100) & (sample < 900)
    flying = (sample >= 300) & (sample < 700)
    high = flying & ~((sample >= 500) & (sample < 540))
    height = legs_m + np.where(high, 0.3, 0.0) + 0.0015 * NOISE[:, 0].clip(-3, 3)
    if at_rest_m == 1.0:
        height[:100] = 1.0
    height[210:230] = height[350:352] = np.nan  # samples without a range
    stands = standing(height, ~running, running, leg_m=0.012)
    edge = int(TOUCH_S / PERIOD_S)
    first, last = np.flatnonzero(running)[[0, -1]]
    assert stands[first:300].all() and stands[700:last + 1].all() and not stands[~running].any()
    assert not stands[300 + edge + 1:700 - edge].any(), "a low pass is no touch-down"


@pytest.mark.parametrize(("wait_s", "stands"), [(SHORT_STAND_S - 0.1, False), (SHORT_STAND_S + 0.1, True)])
def test_a_short_stand_is_part_of_a_take_off(wait_s, stands):
    sample, first = np.arange(N), 200 + round(wait_s / PERIOD_S)
    height = np.where(sample < first + 5, 0.012, 0.3)  # low for TOUCH_S more
    assert standing(height, sample < 200, sample >= 200, 0.012)[200:first].all() == stands


def test_a_vehicle_that_never_stands_with_its_motors_on():
    """A log that begins and ends in the air; and one without a single sample high up, which is for the phases."""
    air, none = np.ones(N, bool), np.zeros(N, bool)
    assert not standing(np.full(N, 0.3), none, air, 0.012).any()
    assert not standing(np.full(N, 0.012), none, air, 0.012).any()
