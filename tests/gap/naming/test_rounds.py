"""A round of the selection on made hovers: which hypothesis stands for a candidate, and which are fitted in full."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.naming import judging, rounds
from airtouch.gap.naming.judging import PricedVariant, cross_validated
from airtouch.gap.naming.policy import FIRST_GAIN, HOPELESS, LEAST_GAIN, PRICE
from airtouch.gap.naming.records import Hypothesis
from airtouch.gap.naming.rounds import round_of
from airtouch.gap.signatures.candidates import all_candidates, terms
from gap_flights import VEHICLE, fly
from hovers import DOWN, FLOOR, candidates_of, hover, swaying, weak


def trial(*flights):
    return judging.trial_of(Data(FLOOR, list(flights)))


def test_best_variant_is_taken():
    on = trial(weak(r3=0.005))
    best = round_of(on, candidates_of(["weak_motor"]), None)["weak_motor"]
    by_rotor = [cross_validated(on, PricedVariant("weak_motor", variant, np.log(4.0)), None)
                for variant in all_candidates()["weak_motor"]]
    assert best.full and best.terms[0].values["rotor"] == 3.0
    assert best.gain == max(j.gain for j in by_rotor) and best.charges.choice_cost == np.log(4.0)
    assert best.evidence == best.gain, "nothing is known of nominal flights"


@pytest.mark.parametrize(("drag", "names"), [(0.001, ["gust"]), (0.0015, ["gust", "rotor_drag"])])
def test_companion_must_gain_longer_gain(drag, names):
    """Drag beside a faint gust adds some 9 nats, which is less than LEAST_GAIN, or some 22."""
    on = trial(swaying(drag, 0.02))
    best = round_of(on, candidates_of(["gust"]), None)["gust"]
    length = best.terms[0].values["length"]
    alone, both = (cross_validated(on, PricedVariant("gust", variant, np.log(3.0)), None)
                   for variant in all_candidates()["gust"] if variant[0].values["length"] == length)
    assert both.gain > alone.gain and (both.gain - alone.gain > LEAST_GAIN) == (len(names) == 2)
    assert [t.name for t in best.terms] == names and best.gain == (both if len(names) == 2 else alone).gain


def test_longer_variant_must_gain_longer_gain_in_any_order():
    short, long = (Hypothesis("gust", (None,) * n, gain, (None, None), full=True) for n, gain in ((1, 30.0), (2, 31.0)))
    for judged in ([short, long], [long, short]):
        assert rounds.best_of_each(None, judged, 0)["gust"] is short, "no companion is asked about"


def test_effect_falls_behind_its_companion():
    on = trial(swaying(drag=0.005))
    best = round_of(on, candidates_of(["gust", "rotor_drag"]), None)
    assert best["rotor_drag"].terms[0].values["horizontal"] == pytest.approx(0.005, rel=0.1)
    assert len(best["gust"].terms) == 2 and best["gust"].gain == best["rotor_drag"].gain - LEAST_GAIN


def test_effect_stays_before_its_companion():
    on = trial(swaying(drag=0.02, gust_mps2=0.1))
    best = round_of(on, candidates_of(["gust", "rotor_drag"]), None)
    (gust, drag), most = best["gust"].terms, best["rotor_drag"].gain
    assert drag.values["horizontal"] == pytest.approx(0.02, rel=0.1) and gust.values["rms"] > 0.0
    # the ready model: drag 0.0147 N/(m/s) of a gust's speed
    assert gust.values["rms"] * gust.values["drag"] / VEHICLE.mass_kg == pytest.approx(0.1, rel=0.35)
    assert best["gust"].gain > most + LEAST_GAIN


@pytest.mark.parametrize(("further_gain", "behind"), [(90.0, True), (110.0, False)])
def test_a_gust_must_gain_over_drag_what_a_named_random_effect_must(further_gain, behind):
    """Drag alone gains 400 nats: a quarter is 100, far more than LEAST_GAIN."""
    on = trial(swaying(drag=0.005))
    hypotheses = round_of(on, candidates_of(["gust", "rotor_drag"]), None)
    drag = replace(hypotheses["rotor_drag"], gain=400.0, full=False)
    gust = replace(hypotheses["gust"], gain=400.0 + further_gain, full=False)
    assert len(gust.terms) == 2
    best = rounds.best_of_each(on, [gust, drag], 0)
    assert best["gust"].gain == (400.0 - LEAST_GAIN if behind else 400.0 + further_gain)


def test_screened_strength_is_the_mean_of_both_halves():
    """Pushes of the same size up in one half of the flights and down in the other: 0 in the mean, 1 step either way."""
    flights = [hover(7 + k, (0.0, 0.0, 0.1 if k % 2 else -0.1), length_s=10.0) for k in range(4)]
    best = round_of(trial(*flights), candidates_of(["imu_bias"]), None)["imu_bias"]
    assert best.full is False, "what one half says is wrong on the other: too little for a fit"
    assert best.strength.mean[2] == pytest.approx(0.0, abs=0.1)
    assert best.strength.variance[2] == pytest.approx(1.0, rel=0.1), "half the difference, squared"


def test_rotor_of_the_base_is_not_judged_again():
    on = trial(weak(r3=0.005))
    third = round_of(on, candidates_of(["weak_motor"]), None)["weak_motor"]
    same_rotor = [variant for variant in all_candidates()["weak_motor"] if variant[0].values["rotor"] == 3.0]
    assert round_of(on, {"weak_motor": same_rotor}, third) == {}
    beside = round_of(on, candidates_of(["weak_motor"]), third)["weak_motor"]
    assert beside.terms[0].values["rotor"] == 3.0 != beside.terms[1].values["rotor"]


def test_screening_uses_the_other_halfs_fit():
    """Of a push in one half of the flights the other half's fit leaves something in both, and its own nothing."""
    on = trial(*(hover(20 + k, (0.0, 0.0, 0.0 if k % 2 else -DOWN), length_s=10.0) for k in range(4)))
    mass = cross_validated(on, PricedVariant("mass", terms("mass"), 0.0), None)
    with_own_fits = replace(mass, fits=mass.fits[::-1])
    crosswise, own = (round_of(on, candidates_of(["imu_bias"]), before)["imu_bias"] for before in (mass, with_own_fits))
    assert crosswise.gain < mass.gain - 100.0 < mass.gain - 20.0 < own.gain


@pytest.mark.parametrize(("louder", "full"), [(1.0, False), (1.03, False), (1.05, True)])
def test_unpromising_random_effect_is_not_fitted(louder, full):
    on = trial(hover(7, louder=louder))
    best = round_of(on, candidates_of(["imu_noise"]), None)["imu_noise"]
    assert best.full is full and bool(best.gain > HOPELESS) is full


def test_a_promising_effect_of_the_loop_is_fitted_in_full(flying):
    on = judging.trial_of(Data(flying, fly(1, 62)))
    late = candidates_of(["sensor_latency"])
    assert not round_of(on, late, None)["sensor_latency"].full, "a nominal flight"
    assert round_of(on, late, None, promising=("sensor_latency",))["sensor_latency"].full


def test_every_strength_has_each_parameter_alone(flying):
    data = Data(flying, fly(1, 62))
    on = judging.trial_of(data)
    best = rounds.every_strength(on, candidates_of(["controller_gain"]))["controller_gain"]
    together = best.strength
    _, *variants = all_candidates()["controller_gain"]
    assert together.mean.shape == together.variance.shape == (len(variants),) == (4,)
    for i, variant in enumerate(variants):
        priced = PricedVariant("controller_gain", variant, np.log(len(variants)))
        single = cross_validated(on, priced, None).strength
        assert together.mean[i] == single.mean[i] and together.variance[i] == single.variance[i]
        assert np.isinf(np.delete(single.variance, i)).all() and not np.delete(single.mean, i).any()
    assert best.gain < FIRST_GAIN, "a nominal flight"


def fitted_variants(monkeypatch, study, flights, name):
    """The best hypothesis of an effect, and the free parameters of each variant that is fitted, briefly or in full."""
    fits = []

    def counted(on, variant, base, brief=False, near=None):
        fits.append((variant.terms[0].free, brief))
        return cross_validated(on, variant, base, brief, near)

    monkeypatch.setattr(rounds, "cross_validated", counted)
    monkeypatch.setattr(rounds, "map_on_two_cores", lambda function, items: [function(x) for x in items])
    return round_of(judging.trial_of(Data(study, flights)), candidates_of([name]), None)[name], set(fits)


def test_gains_that_change_nothing_together_are_not_tried_alone(flying, monkeypatch):
    best, fits = fitted_variants(monkeypatch, flying, fly(1, 2), "controller_gain")
    assert fits == {(terms("controller_gain")[0].signature.free, True)} and not best.full


def test_a_gain_that_changes_is_fitted_in_full(flying, monkeypatch):
    best, fits = fitted_variants(monkeypatch, flying, fly(1, 2, {"controller_gain": {"rate": 0.6}}), "controller_gain")
    assert {(("rate",), True), (("rate",), False)} <= fits and best.full and best.gain > 100.0


def test_effects_at_edges_are_not_fitted_without_an_edge(monkeypatch):
    best, fits = fitted_variants(monkeypatch, FLOOR, [hover(7)], "range_step")
    assert not fits and not best.full and best.gain == pytest.approx(-PRICE)
    assert not best.strength.mean.any() and (np.diag(best.strength.covariance) > 100.0).all()
