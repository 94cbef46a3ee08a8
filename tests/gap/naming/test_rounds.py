"""A round of the selection on made hovers: which hypothesis stands for a candidate, and which are fitted in full."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.evidence.data import Data
from airtouch.gap.naming import judging, rounds, select
from airtouch.gap.naming.judging import PricedVariant, covariance_among_all, cross_validated
from airtouch.gap.naming.policy import HOPELESS, LEAST_GAIN
from airtouch.gap.naming.records import Candidate
from airtouch.gap.naming.rounds import round_of
from airtouch.gap.signatures.candidates import all_candidates, terms
from gap_flights import VEHICLE
from hovers import DOWN, FLOOR, candidates_of, hover, scattered, swaying, weak, with_a_push


def trial(*flights):
    return judging.trial_of(Data(FLOOR, list(flights)))


def test_of_variants_with_as_many_terms_the_best_is_taken():
    on = trial(weak(r3=0.005))
    best = round_of(on, candidates_of(["weak_motor"]), None)["weak_motor"]
    by_rotor = [cross_validated(on, PricedVariant("weak_motor", variant, np.log(4.0)), None)
                for variant in all_candidates()["weak_motor"]]
    assert best.full and best.terms[0].values["rotor"] == 3.0
    assert best.gain == max(j.gain for j in by_rotor) and best.charges.choice_cost == np.log(4.0)
    assert best.evidence == best.gain, "nothing is known of nominal flights"


@pytest.mark.parametrize(("drag", "names"), [(0.001, ["gust"]), (0.0015, ["gust", "rotor_drag"])])
def test_a_companion_must_earn_its_place_beside_the_effect(drag, names):
    """Drag beside a faint gust adds some 9 nats, which is less than LEAST_GAIN, or some 22."""
    on = trial(swaying(drag, 0.02))
    best = round_of(on, candidates_of(["gust"]), None)["gust"]
    length = best.terms[0].values["length"]
    alone, both = (cross_validated(on, PricedVariant("gust", variant, np.log(3.0)), None)
                   for variant in all_candidates()["gust"] if variant[0].values["length"] == length)
    assert both.gain > alone.gain and (both.gain - alone.gain > LEAST_GAIN) == (len(names) == 2)
    assert [t.name for t in best.terms] == names and best.gain == (both if len(names) == 2 else alone).gain


def test_a_longer_variant_must_earn_its_length_whatever_comes_first():
    short, long = (Candidate("gust", (None,) * n, gain, (None, None), full=True) for n, gain in ((1, 30.0), (2, 31.0)))
    for judged in ([short, long], [long, short]):
        assert rounds.best_of_each(judged, 0)["gust"] is short


def test_where_its_companion_alone_gains_as_much_it_is_that_which_gains():
    on = trial(swaying(drag=0.005))
    best = round_of(on, candidates_of(["gust", "rotor_drag"]), None)
    assert best["rotor_drag"].terms[0].values["horizontal"] == pytest.approx(0.005, rel=0.1)
    assert len(best["gust"].terms) == 2 and best["gust"].gain == best["rotor_drag"].gain - LEAST_GAIN


def test_where_gusts_blow_as_well_their_companion_leaves_them_their_gain():
    on = trial(swaying(drag=0.02, gust_mps2=0.1))
    best = round_of(on, candidates_of(["gust", "rotor_drag"]), None)
    (gust, drag), most = best["gust"].terms, best["rotor_drag"].gain
    assert drag.values["horizontal"] == pytest.approx(0.02, rel=0.1) and gust.values["rms"] > 0.0
    # the ready model: drag 0.0147 N/(m/s) of a gust's speed
    assert gust.values["rms"] * gust.values["drag"] / VEHICLE.mass_kg == pytest.approx(0.1, rel=0.35)
    assert best["gust"].gain > most + LEAST_GAIN


def test_a_first_look_has_the_mean_of_both_halves_and_their_spread():
    """Pushes of the same size up in one half of the flights and down in the other: 0 in the mean, 1 step either way."""
    flights = [hover(7 + k, (0.0, 0.0, 0.1 if k % 2 else -0.1), length_s=10.0) for k in range(4)]
    best = round_of(trial(*flights), candidates_of(["imu_bias"]), None)["imu_bias"]
    assert best.full is False, "what one half says is wrong on the other: too little for a fit"
    assert best.strength.mean[2] == pytest.approx(0.0, abs=0.1)
    assert best.strength.variance[2] == pytest.approx(1.0, rel=0.1), "half the difference, squared"


def test_the_rotor_that_is_chosen_already_is_not_tried_again_and_the_others_are():
    on = trial(weak(r3=0.005))
    third = round_of(on, candidates_of(["weak_motor"]), None)["weak_motor"]
    same_rotor = [variant for variant in all_candidates()["weak_motor"] if variant[0].values["rotor"] == 3.0]
    assert round_of(on, {"weak_motor": same_rotor}, third) == {}
    beside = round_of(on, candidates_of(["weak_motor"]), third)["weak_motor"]
    assert beside.terms[0].values["rotor"] == 3.0 != beside.terms[1].values["rotor"]


def test_each_half_is_looked_at_as_the_hypothesis_fitted_on_the_other_leaves_it():
    """Of a push in one half of the flights the other half's fit leaves something in both, and its own nothing."""
    on = trial(*(hover(20 + k, (0.0, 0.0, 0.0 if k % 2 else -DOWN), length_s=10.0) for k in range(4)))
    mass = cross_validated(on, PricedVariant("mass", terms("mass"), 0.0), None)
    with_own_fits = replace(mass, fits=mass.fits[::-1])
    crosswise, own = (round_of(on, candidates_of(["imu_bias"]), before)["imu_bias"] for before in (mass, with_own_fits))
    assert crosswise.gain < mass.gain - 100.0 < mass.gain - 20.0 < own.gain


@pytest.mark.parametrize(("louder", "full"), [(1.0, False), (1.03, False), (1.05, True)])
def test_a_random_effect_that_promises_little_is_looked_at_and_not_fitted(louder, full):
    on = trial(hover(7, louder=louder))
    best = round_of(on, candidates_of(["imu_noise"]), None)["imu_noise"]
    assert best.full is full and bool(best.gain > HOPELESS) is full


def test_the_covariance_of_some_parameters_says_nothing_of_the_others():
    _, *variants = all_candidates()["controller_gain"]
    (attitude,) = next(t for t in variants if t[0].free == ("attitude",))
    expected = np.diag([np.inf, 2.0, np.inf, np.inf])
    np.testing.assert_array_equal(covariance_among_all(attitude, np.array([[2.0]])), expected)
    offset = terms("com_offset")[0]
    both = np.array([[2.0, -1.0], [-1.0, 3.0]])
    np.testing.assert_array_equal(covariance_among_all(offset, both), both)


def by_relations(monkeypatch, explained, likeliest="mass"):
    """A selection as of a library of relations that holds for the flights, and the judgements that it is asked with."""
    answer, judgements = SimpleNamespace(explained=explained), []
    inference = SimpleNamespace(likeliest=likeliest, evidence={likeliest: 100.0})

    def selection_by_relations(trial, candidates, alone, given, progress):
        assert given is inference
        judgements.append(alone)
        return answer

    monkeypatch.setattr(select, "inference_of", lambda data, names: inference)
    monkeypatch.setattr(select, "selection_by_relations", selection_by_relations)
    return answer, judgements


@pytest.mark.parametrize("explained", [True, False])
def test_where_the_relations_of_signals_hold_their_effects_are_chosen(monkeypatch, explained):
    """They are asked with what was judged; what acts all along is not selected by the spectra anew."""
    answer, judgements = by_relations(monkeypatch, explained)
    data = Data(FLOOR, [hover(1, (0.0, 0.0, -DOWN))])
    assert select.select(data, candidates_of(["mass"])) is answer
    (judged_alone,) = judgements
    assert isinstance(judged_alone["mass"], Candidate) and judged_alone["mass"].gain > 100.0


def test_a_wake_that_the_relations_of_signals_leave_unexplained_is_selected_by_the_spectra(monkeypatch):
    data = Data(scattered(), [with_a_push(9.0, 15.0)])
    answer, _ = by_relations(monkeypatch, explained=True, likeliest="downwash")
    assert select.select(data, candidates_of(["mass"])) is answer
    by_relations(monkeypatch, explained=False, likeliest="downwash")
    assert [s.name for s in select.select(data, candidates_of(["mass"])).named_steps] == ["downwash"]


def test_a_wake_of_some_seconds_is_named_though_another_effect_is_likeliest_in_the_whole_flight(monkeypatch):
    data = Data(scattered(), [with_a_push(9.0, 15.0)])
    by_relations(monkeypatch, explained=False, likeliest="mass")
    assert [s.name for s in select.select(data, candidates_of(["mass"])).named_steps] == ["downwash"]


def test_a_wind_that_comes_and_goes_is_named_only_if_it_is_likeliest_in_the_whole_flight(monkeypatch):
    data, passing = Data(scattered(), [with_a_push(9.0, 15.0)]), select.passing_effect
    monkeypatch.setattr(select, "passing_effect", lambda *arguments: replace(passing(*arguments), name="wind"))
    answer, _ = by_relations(monkeypatch, explained=False, likeliest="mass")
    assert select.select(data, candidates_of(["mass"])) is answer
