"""A round of the selection by hand: given what each hypothesis gains, which of them stands for its candidate."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from airtouch.gap.evidence.fit import Fit
from airtouch.gap.naming import rounds, select
from airtouch.gap.naming.judging import LEAST_GAIN, PRICE, covariance_among_all
from airtouch.gap.naming.selection import Judged
from airtouch.gap.signatures.candidates import all_candidates, free_of, terms
from hovers import candidates_of

SCREEN = SimpleNamespace(shows=lambda term: True)
STUDY = SimpleNamespace(scatter=None, controller=None)
BENCH = SimpleNamespace(data=SimpleNamespace(study=STUDY), parts=(), screen=SCREEN)  #: no flight: gains are given
CHOSEN = Judged("mass", (terms("mass")[0],), 30.0)


def by_hand(monkeypatch, gain_of=None, look_of=None, first=None):
    """`round_of` where a full fit of terms gains gain_of(terms), and looks say what they are given; the full fits."""
    fits = []

    def crossed(on, name, new, before, choice):
        fits.append((name, new))
        return Judged(name, (*(before.terms if before else ()), *new), gain_of(new), choice=choice,
                      strength=np.zeros(len(free_of(new[0].effect))))

    monkeypatch.setattr(rounds, "crossed", crossed)
    monkeypatch.setattr(rounds, "random_look", lambda screen, parts, left, power, term: (look_of(term), np.ones(1)))
    monkeypatch.setattr(rounds, "first_order", lambda screen, parts, left, power, new, held: first(new))
    return fits


def test_of_variants_with_as_many_terms_the_best_is_taken_however_little_it_gains_more(monkeypatch):
    gains = {t[0].free: 20.0 + k for k, t in enumerate(all_candidates()["controller_gain"])}
    by_hand(monkeypatch, lambda new: gains[new[0].free])
    best = rounds.round_of(BENCH, candidates_of(["controller_gain"]), None)["controller_gain"]
    assert best.gain == 24.0 and best.terms[0].free == ("height",)
    assert best.evidence == 24.0, "nothing is known of nominal flights"


@pytest.mark.parametrize(("more", "with_drag"), [(LEAST_GAIN - 1.0, False), (LEAST_GAIN + 1.0, True)])
def test_a_companion_must_earn_its_place_beside_the_effect(monkeypatch, more, with_drag):
    fits = by_hand(monkeypatch, lambda new: 40.0 + more * (len(new) - 1), lambda t: 5.0 + (t.values["length"] == 0.5))
    best = rounds.round_of(BENCH, candidates_of(["gust"]), CHOSEN)["gust"]
    assert [t.name for t in best.terms] == ["mass", "gust"] + ["rotor_drag"] * with_drag
    # the first look chooses the variant; of that one, alone and with its companion, and of no other a fit is made
    assert [[t.name for t in new] for _, new in fits] == [["gust"], ["gust", "rotor_drag"]]
    assert {new[0].values["length"] for _, new in fits} == {0.5}


@pytest.mark.parametrize(("drag", "left"), [(75.0, 75.0 - LEAST_GAIN), (80.0 - LEAST_GAIN, 80.0), (5.0, 80.0)])
def test_where_its_companion_alone_gains_as_much_it_is_that_which_gains(monkeypatch, drag, left):
    """A gust with drag gains 80 over all; drag alone 75, or 68, which leaves it just what it must add, or 5."""
    gains = {("gust",): 10.0, ("gust", "rotor_drag"): 80.0, ("rotor_drag",): drag}
    by_hand(monkeypatch, lambda new: gains[tuple(t.name for t in new)], lambda t: 5.0,
            lambda new: (drag + PRICE, np.zeros((2, 2)), np.ones((2, 2))))
    best = rounds.round_of(BENCH, candidates_of(["gust", "rotor_drag"]), None)
    assert best["rotor_drag"].gain == drag and len(best["gust"].terms) == 2
    assert best["gust"].gain == pytest.approx(left)


def test_a_first_look_has_the_mean_of_both_halves_and_their_spread(monkeypatch):
    """Halves that say 1 and 3 steps of x, and 5 of y both; variance 4 of each parameter on one half, none on the other.

    The variance of the mean is a quarter of the sum, and no less than half the difference squared.
    """
    by_hand(monkeypatch, first=lambda new: (2.0, [(1.0, 5.0), (7.0, 5.0)], [(4.0, 8.0), (0.0, 0.0)]))
    best = rounds.round_of(BENCH, candidates_of(["com_offset"]), None)["com_offset"]
    assert best.full is False, "too little for a fit"
    assert best.strength.tolist() == [4.0, 5.0]
    assert best.variance.tolist() == [9.0, 2.0]
    assert best.gain == pytest.approx(2.0 - PRICE)


def test_the_rotor_that_is_chosen_already_is_not_tried_again_and_the_others_are(monkeypatch):
    tried = []

    def first(new):
        tried.append(new[0].values["rotor"])
        return 0.0, np.zeros((2, 1)), np.ones((2, 1))

    by_hand(monkeypatch, first=first)
    rounds.round_of(BENCH, candidates_of(["weak_motor"]), Judged("weak_motor", (terms("weak_motor")[2],), 30.0))
    assert tried == [1, 2, 4]


def test_each_half_is_looked_at_as_the_hypothesis_fitted_on_the_other_leaves_it(monkeypatch):
    asked, seen = [], []
    problem = SimpleNamespace(power=np.array([1.0]))

    def left_over(data, part, fitted):
        asked.append((part, fitted))
        return problem, np.array([len(asked)]), np.array([1.0 + len(asked)])

    def first(new):
        return 0.0, np.zeros((2, 1)), np.ones((2, 1))

    by_hand(monkeypatch, first=first)
    monkeypatch.setattr(rounds, "left_over", left_over)
    monkeypatch.setattr(rounds, "first_order", lambda screen, parts, left, power, new, held:
                        (seen.append((left, power)), first(new))[1])
    fits = tuple(Fit(CHOSEN.terms, np.array([k]), np.eye(1), np.zeros(0), 0.0) for k in range(2))
    one, two = (replace(f, terms=(f"fit {k}",)) for k, f in enumerate(fits))
    on = SimpleNamespace(**{**vars(BENCH), "parts": ("first half", "second half")})
    rounds.round_of(on, candidates_of(["inertia"]), replace(CHOSEN, fits=(one, two)))
    assert asked == [("first half", ("fit 1",)), ("second half", ("fit 0",))]
    assert seen == [([1, 2], [1.0, 2.0])]


@pytest.mark.parametrize(("gain", "fitted"), [(rounds.HOPELESS, False), (rounds.HOPELESS + 1e-6, True)])
def test_a_random_effect_that_promises_little_is_looked_at_and_not_fitted(monkeypatch, gain, fitted):
    by_hand(monkeypatch, lambda new: 9.0, lambda t: gain)
    best = rounds.round_of(BENCH, candidates_of(["imu_noise"]), None)["imu_noise"]
    assert best.full is fitted and best.gain == (9.0 if fitted else 0.0)


def test_the_covariance_of_some_parameters_says_nothing_of_the_others():
    _, *alone = all_candidates()["controller_gain"]
    (attitude,) = next(t for t in alone if t[0].free == ("attitude",))
    expected = np.diag([np.inf, 2.0, np.inf, np.inf])
    np.testing.assert_array_equal(covariance_among_all(attitude, np.array([[2.0]])), expected)
    offset = terms("com_offset")[0]
    both = np.array([[2.0, -1.0], [-1.0, 3.0]])
    np.testing.assert_array_equal(covariance_among_all(offset, both), both)


@pytest.mark.parametrize("explained", [True, False])
def test_where_the_relations_of_signals_explain_the_flights_they_decide_alone(monkeypatch, explained):
    """They are asked with what was judged; what they leave unexplained is selected by the spectra."""
    answer, inference, candidates, asked = SimpleNamespace(explained=explained), object(), candidates_of(["mass"]), []
    alone = {"mass": Judged("mass", CHOSEN.terms, 3.0)}

    def related(*arguments):
        asked.append(arguments)
        return answer

    class Reached(Exception):
        """The spectra are asked."""

    def spectra(*arguments):
        raise Reached

    def progress(name):
        raise AssertionError(name)

    monkeypatch.setattr(select, "trial_of", lambda data: BENCH)
    monkeypatch.setattr(select, "round_of", lambda on, some, before, say: alone)
    monkeypatch.setattr(select, "inference_of", lambda data, names: inference if names == ["mass"] else None)
    monkeypatch.setattr(select, "related", related)
    monkeypatch.setattr(select, "_passing", spectra)
    if explained:
        assert select.select(BENCH.data, candidates, progress) is answer
    else:
        with pytest.raises(Reached):
            select.select(BENCH.data, candidates, progress)
    assert asked == [(BENCH, candidates, alone, inference, progress)]
