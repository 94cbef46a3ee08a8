"""One hypothesis judged: the two halves, a parameter at its bound, covariances, and what a choice costs."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.evidence.clock import loss
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import FittedTerms
from airtouch.gap.evidence.problem import TWO_FOLDS
from airtouch.gap.naming import judging
from airtouch.gap.naming.judging import PricedVariant, covariance_among_all, strength_of
from airtouch.gap.naming.records import Hypothesis
from airtouch.gap.signals.spectra import AIR
from airtouch.gap.signatures.candidates import all_candidates, terms
from gap_flights import fly
from hovers import DOWN, FLOOR, hover


def test_at_bound():
    mass = all_candidates()["mass"][0][0]
    low, high = mass.bounds()
    near = judging.NEAR_BOUND
    for x, at in ((high, True), (high * (near + 1e-6), True), (high * 0.99, False), (low, True), (0.99 * low, False),
                  (0.0 * high, False)):
        assert judging.at_bound(mass, x).tolist() == [at]


def test_halves_share_no_block_and_leave_none_out():
    three = Data(FLOOR, [hover(8), hover(9), hover(10, length_s=3.0)])
    first, second = judging.halves(three)
    for (i, state, blocks), (j, of, other) in zip(first.pieces, second.pieces, strict=True):
        assert (i, state) == (j, of) and len(blocks) == len(three.block_starts[i][state]) and (blocks ^ other).all()
    (_, _, blocks), *_, (_, _, short) = first.pieces
    assert blocks[:9].tolist() == [True] * 3 + [False] * 3 + [True] * 3
    assert 0 < short.sum() <= len(short), "a short flight is in both halves where it can be"
    five = Data(FLOOR, [hover(k) for k in range(5)])
    first, second = ({i for i, _, chosen in part.pieces if chosen.all()} for part in judging.halves(five))
    assert (first, second) == ({0, 2, 4}, {1, 3})
    assert all(chosen.dtype == bool for part in judging.halves(five) for _, _, chosen in part.pieces)
    assert {r for _, r, _ in judging.halves(three)[0].pieces} == {AIR}


@pytest.mark.parametrize(("broken", "by_flight"), [((1, 3, 5, 7), True), ((0, 2), True), ((0, 1, 2, 3, 4), False)])
def test_flights_without_a_block_leave_no_half_empty(broken, by_flight):
    """Rows lost each 2 s, so that no block of 2.56 s is whole; the others have 10 s, in turns for either half."""
    holes = np.arange(1000) % 200 < 40
    flights = [hover(k, length_s=10.0, **({"lost": holes} if k in broken else {})) for k in range(8)]
    whole = [k for k in range(8) if k not in broken]
    first, second = judging.halves(Data(FLOOR, flights))
    in_first, in_second = ([i for i, state, chosen in half.pieces if state == AIR] for half in (first, second))
    assert (in_first, in_second) == ((whole[::2], whole[1::2]) if by_flight else (whole, whole))


def test_covariance_of_a_parameter_that_is_not_free_is_infinite():
    _, *variants = all_candidates()["controller_gain"]
    (attitude,) = next(t for t in variants if t[0].free == ("attitude",))
    expected = np.diag([np.inf, 2.0, np.inf, np.inf])
    np.testing.assert_array_equal(covariance_among_all(attitude, np.array([[2.0]])), expected)
    offset = terms("com_offset")[0]
    both = np.array([[2.0, -1.0], [-1.0, 3.0]])
    np.testing.assert_array_equal(covariance_among_all(offset, both), both)


@pytest.mark.parametrize("beside_mass", [False, True])
def test_choice_of_a_clock_effect_is_charged(beside_mass):
    """What lost rows gain, less the cost of the choice, alone and beside an effect that shows in the spectra."""
    lost = np.random.default_rng(0).random(3000) < 0.1
    data = Data(FLOOR, [replace(hover(2, (0.0, 0.0, -DOWN)), lost=lost)])
    trial = judging.trial_of(data)
    mass = judging.cross_validated(trial, PricedVariant("mass", tuple(terms("mass")), 0.25), None)
    base = mass if beside_mass else None
    both = judging.cross_validated(trial, PricedVariant("packet_loss", tuple(terms("packet_loss")), 0.5), base)
    assert both.gain - (base.gain if base else 0.0) == pytest.approx(loss(data).gain - 0.5)
    assert both.charges.choice_cost == (0.75 if beside_mass else 0.5)


def test_uncertain_floor_loss_is_given_back_once(flying):
    """By definition: what both gain, and what the first one gained while the commands' floor was sure."""
    data = Data(flying, fly(1, 2, {"sensor_latency": {"delay": 0.008}}))
    on = judging.trial_of(data)
    latency = judging.PricedVariant("sensor_latency", all_candidates()["sensor_latency"][0], 0.0)
    late = judging.cross_validated(on, latency, None)
    both = judging.cross_validated(on, judging.PricedVariant("imu_noise", all_candidates()["imu_noise"][0], 0.5), late)
    sure, unsure = (sum(judging.gain_of(on, 1 - k, late.fits[k].terms, uncertain) for k in (0, 1))
                    for uncertain in (False, True))
    joint_gain = sum(judging.gain_of(on, 1 - k, both.fits[k].terms) for k in (0, 1))
    assert sure - unsure > 5.0 and late.charges.uncertain_floor_loss == 0.0 and both.charges.choice_cost == 0.5
    assert both.charges.uncertain_floor_loss == pytest.approx(sure - unsure)
    assert both.gain == pytest.approx(joint_gain + (sure - unsure) - 0.5)
    third = judging.cross_validated(on, judging.PricedVariant("vibration", all_candidates()["vibration"][0], 0.0), both)
    assert third.charges.uncertain_floor_loss == both.charges.uncertain_floor_loss, "paid once"


def test_a_random_effect_that_is_not_there_costs_one_of_the_commands_nothing(study):
    """Beside a random effect the commands' floor is less certain: a changed gain, seen in them alone, gains less."""
    data = Data(study, fly(1, 54, {"controller_gain": {"height": 0.5}}))
    on = judging.trial_of(data)
    gain = next(t for t in terms("controller_gain") if "height" in t.free)
    chosen = judging.cross_validated(on, judging.PricedVariant("controller_gain", (gain,), 0.0), None)
    certain, uncertain = (sum(judging.gain_of(on, test, chosen.fits[train].terms, uncertain_floor)
                              for train, test in TWO_FOLDS) for uncertain_floor in (False, True))
    assert isinstance(chosen, Hypothesis) and certain > uncertain + 10.0
    vibration = judging.PricedVariant("vibration", (terms("vibration")[0],), 0.0)
    both = judging.cross_validated(on, vibration, chosen)
    assert both.gain == pytest.approx(chosen.gain, abs=2.0)
    assert both.charges.uncertain_floor_loss == pytest.approx(certain - uncertain)


def test_a_drag_beside_a_wind_has_its_own_strength():
    """The wind's companion is a drag too, and stands before it."""
    (drag,) = terms("rotor_drag")[:1]
    companion, own = (replace(drag, companion=is_companion).fitted(np.full(len(drag.free), x))
                      for is_companion, x in ((True, 3.0), (False, 6.0)))
    both = (companion, own)
    fits = [FittedTerms(both, np.concatenate([t.scaled(t.values) for t in both]), np.eye(2 * len(drag.free)))] * 2
    for term, x in ((own, 6.0), (companion, 3.0)):
        np.testing.assert_allclose(strength_of(term, both, fits).mean, x)
