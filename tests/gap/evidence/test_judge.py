"""How likely blocks are under effects: in all, cell by cell, and with offsets between flights fitted anew."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.evidence.cells import CELLS, REPLAY_VIEW, cell_indices
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.judge import cell_gains, judge, judged_blocks
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.signals.channels import COLUMN, COUNT
from airtouch.gap.signals.spectra import OVERLAP_WEIGHT
from airtouch.gap.signatures.candidates import terms
from hovers import FLOOR, hover

PUSH = 0.3  #: m/s^2 forward, in one hover
BIAS = terms("imu_bias")[0]


def biased(mps2):
    """The effect that the accelerometer shows so much forward acceleration."""
    return BIAS.fitted(BIAS.scaled({**BIAS.values, "acc_x": mps2}))


@pytest.fixture(scope="module")
def pushed():
    data = Data(FLOOR, [hover(1, (PUSH, 0.0, 0.0), length_s=12.0)])
    return data, whole_of(data)


def test_cells_gain_together_what_all_values_gain(pushed):
    data, blocks = pushed
    gains = cell_gains(data, blocks, [biased(PUSH)])
    assert gains.shape == (CELLS,)
    assert gains.sum() == pytest.approx(judge(data, blocks, [biased(PUSH)]) - judge(data, blocks, ()))


def test_the_right_effect_gains_in_its_own_channel_alone(pushed):
    """A constant forward force is in the lowest band of the force along x, in the air and at rest."""
    data, blocks = pushed
    gains = cell_gains(data, blocks, [biased(PUSH)])
    view, band, channel = cell_indices(int(np.argmax(gains)))
    assert (view, band, channel) == (REPLAY_VIEW, 0, COLUMN["force_x"]) and gains.max() > 10.0
    np.testing.assert_allclose(gains[cell_indices(np.arange(CELLS)).channel != COLUMN["force_x"]], 0.0, atol=1e-9)


def test_what_a_right_effect_leaves_is_noise_of_the_expected_power(pushed):
    data, blocks = pushed
    judged = judged_blocks(data, blocks, [biased(PUSH)])
    lift = judged.problem.elements.channel == COLUMN["force_x"]
    energy = np.abs(judged.residual[lift]) ** 2 / judged.expected_power[lift]
    assert energy.mean() == pytest.approx(1.0, abs=4.0 / np.sqrt(OVERLAP_WEIGHT * lift.sum()))


def test_an_offset_is_fitted_anew_and_costs_what_its_prior_says():
    """A force that is one of many between flights: the offset takes nearly all of it, at the cost of a normal prior."""
    spread = np.zeros(COUNT)
    spread[COLUMN["force_x"]] = 2.0 * PUSH
    data = Data(replace(FLOOR, floor=replace(FLOOR.floor, offset=spread)), [hover(1, (PUSH, 0.0, 0.0), length_s=12.0)])
    judged = judged_blocks(data, whole_of(data), ())
    assert judged.cost == pytest.approx(0.5 * 0.5 ** 2, rel=0.1)
    assert judge(data, whole_of(data), ()) == judged.log_likelihood - judged.cost
    alone = Data(FLOOR, data.flights)
    assert judge(data, whole_of(data), ()) > judge(alone, whole_of(alone), ()) + 10.0
