"""Moments of contact, in signals whose knocks and take-offs are made."""

import numpy as np

from airtouch.gap.flights.clock import PERIOD_S
from airtouch.gap.flights.contact import CONTACT_S, SETTLED_S, jolts, knocks, near_ground, within

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
