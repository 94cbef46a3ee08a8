"""Effects judged to first order whose gain or strength is known in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.judge import judged_blocks
from airtouch.gap.evidence.problem import problem_of, whole_of
from airtouch.gap.naming.judging import trial_of
from airtouch.gap.naming.screening.first_order import column, judge_means, judge_random
from airtouch.gap.signals.channels import COLUMN, COUNT
from airtouch.gap.signatures.candidates import terms
from hovers import DOWN, FLOOR, hover, own_gain

SPREAD = 0.1  #: m/s^2, standard deviation of the lift's offset between nominal flights


@pytest.mark.parametrize("count", [1, 4])
def test_gain_of_a_push_is_what_its_offsets_cost(count):
    """Every flight is pushed down alike: without an effect its offset costs (DOWN / SPREAD)^2 / 2 nats, with one none.

    One flight is halved by blocks, so that it has an offset in either half.
    """
    offset = np.where(np.arange(COUNT) == COLUMN["force_z"], SPREAD, 0.0)
    study = replace(FLOOR, floor=replace(FLOOR.floor, offset=offset))
    data = Data(study, [hover(40 + k, (0.0, 0.0, -DOWN), name=f"flight {k}") for k in range(count)])
    halves = [judged_blocks(data, part, ()) for part in trial_of(data).halves]
    judged = judge_means(data, halves, terms("mass")[:1])
    assert judged.gain == pytest.approx(max(count, 2) * 0.5 * (DOWN / SPREAD) ** 2, rel=0.1)


def test_each_half_is_fitted_by_its_own_push():
    """By flight in turns pushed down by 0.2 and 0.4 m/s^2: a bias of the accelerometer is as large, by definition."""
    data = Data(FLOOR, [hover(40 + k, (0.0, 0.0, -(0.4 if k % 2 else 0.2)), length_s=10.0) for k in range(4)])
    halves = [judged_blocks(data, half, ()) for half in trial_of(data).halves]
    (bias,) = terms("imu_bias")[:1]
    judged = judge_means(data, halves, [bias])
    acc_z = bias.free.index("acc_z")
    of_halves = [x[acc_z] * bias.step("acc_z") for x in judged.estimates]
    assert of_halves == pytest.approx([-0.2, -0.4], rel=0.03)


@pytest.mark.parametrize("louder", [1.0, 1.2])
def test_noise_gains_as_much_as_its_fit(louder):
    """Beside no effect nothing is approximate: the held-out gain by its definition."""
    data = Data(FLOOR, [hover(7, louder=louder)])
    (noise,) = terms("imu_noise")
    gain, strength = judge_random([judged_blocks(data, half, ()) for half in trial_of(data).halves], noise)
    assert gain == pytest.approx(own_gain(data, [noise]), rel=0.02, abs=0.5)
    # twice the declared power is the floor, and the declared one itself is no part of what is added
    factor = noise.at(strength)["factor"]
    assert factor == pytest.approx(np.sqrt(max(2.0 * louder ** 2 - 1.0, 1.0)), rel=0.03)


@pytest.mark.parametrize("always_first", [True, False])
def test_a_passing_effect_changes_the_spectra_of_its_own_seconds_alone(always_first):
    """Whichever is screened first: of 20 s the passing one has 5, and so no change in the blocks outside them."""
    data = Data(FLOOR, [hover(40, length_s=20.0)])
    always = terms("mass")[0]
    passing = replace(always, gate=((data.flights[0].name, 10.0, 15.0),))
    problem = problem_of(data, whole_of(data))
    changes = {}
    for term in (always, passing) if always_first else (passing, always):
        changes[bool(term.gate)] = np.sum(np.abs(column(data, problem, term, 0)) ** 2)
    assert 0.15 < changes[True] / changes[False] < 0.35
