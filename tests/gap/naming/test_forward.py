"""Forward selection on candidates whose gain and evidence a test makes up: which are added, and which have a name."""

from types import SimpleNamespace

import pytest

from airtouch.gap.naming import forward as module
from airtouch.gap.naming.forward import Search, forward
from airtouch.gap.naming.policy import (
    FIRST_GAIN,
    LEAST_GAIN,
    MISFIT_SHARE_DEVIATION,
    MOST_DEVIATIONS,
    MOST_EFFECTS,
    WORTH_AGAIN,
)
from airtouch.gap.naming.records import Candidate


@pytest.fixture
def select(monkeypatch):
    """A selection among candidates {name: (own gain, evidence)}, which gain as much beside others as alone.

    Returns the state, and the names that were judged in each round.
    """
    def run(candidates, passing=None, screened=(), left=(), first_gain=FIRST_GAIN):
        def judged(name, so_far=0.0):
            gain, evidence = candidates[name]
            return Candidate(name, (), so_far + gain, full=name not in screened, evidence=evidence)

        def round_of(on, worth, chosen, progress, promising):
            names = [n for n in worth if n not in added]
            rounds.append(names)
            return {n: judged(n, chosen.gain) for n in names}

        def best_of(worth, before):
            best = original(worth, before)
            if best is not None:
                added.append(best.name)
            return best

        rounds, added, original = [], [], module._best_of
        monkeypatch.setattr(module, "round_of", round_of)
        monkeypatch.setattr(module, "_best_of", best_of)
        monkeypatch.setattr(module, "least_further_gain", lambda trial, last, candidate: LEAST_GAIN)
        monkeypatch.setattr(module, "is_random_misfit", lambda trial, last, candidate: candidate.name in left)
        monkeypatch.setattr(module, "with_leave_one_out_gains", lambda on, steps: steps)
        alone = {n: judged(n) for n in candidates}
        trial = SimpleNamespace(policy=SimpleNamespace(first_gain=first_gain))
        search = Search(trial, dict.fromkeys(candidates, [()]), alone, dict.fromkeys(candidates, first_gain),
                        lambda _: None)
        return forward(search, passing), rounds

    return run


def names(state):
    return [(s.name, s.named) for s in state.steps]


def test_effects_are_added_from_the_one_that_gains_most_on_and_no_more_than_may_be_named(select):
    state, _ = select({n: (100.0 * k, 20.0) for k, n in enumerate("abcde", 1)})
    assert names(state) == [("e", True), ("d", True), ("c", True)] and len(state.steps) == MOST_EFFECTS
    assert state.gain == 1200.0


def test_what_gains_too_little_or_was_only_looked_at_is_not_added(select):
    state, _ = select({"a": (FIRST_GAIN - 0.1, 20.0), "b": (100.0, 20.0)}, screened=("b",))
    assert state.steps == () and state.gain == 0.0
    state, _ = select({"a": (50.0, 20.0), "b": (LEAST_GAIN - 0.1, 20.0)})
    assert names(state) == [("a", True)], "beside another it needs more"


def test_of_two_that_gain_nearly_as_much_the_rarer_is_taken_and_beyond_certainty_the_gain_decides(select):
    assert names(select({"a": (103.0, 10.0), "b": (100.0, 15.0)})[0])[0][0] == "b"
    assert names(select({"a": (103.0, 20.0), "b": (100.0, 90.0)})[0])[0][0] == "a"


def test_what_nominal_flights_have_as_well_is_a_deviation_and_after_three_only_what_is_evident_is_added(select):
    deviations = {n: (200.0 + k, FIRST_GAIN - 0.1) for k, n in enumerate("abcde")}
    state, _ = select(deviations)
    assert names(state) == [("e", False), ("d", False), ("c", False)] and state.deviations == MOST_DEVIATIONS
    state, _ = select({**deviations, "f": (30.0, FIRST_GAIN)})
    assert names(state)[3:] == [("f", True)] and state.named == ["f"]


def test_beside_a_deviation_the_first_name_needs_what_any_first_effect_does(select):
    judged = {"deviation": (200.0, 0.0), "named": (LEAST_GAIN - 0.1, FIRST_GAIN)}
    assert names(select(judged)[0]) == [("deviation", False), ("named", True)]
    assert names(select(judged, first_gain=LEAST_GAIN)[0]) == [("deviation", False)]


def test_a_random_effect_that_another_leaves_makes_no_room_for_deviations(select):
    deviations = {n: (400.0 + k, FIRST_GAIN - 0.1) for k, n in enumerate("abcde")}
    found = {"f": (150.0, 20.0), "noise": (140.0, 20.0)}
    state, _ = select({**deviations, **found}, left=("noise",))
    assert names(state) == [("e", False), ("d", False), ("c", False), ("f", True), ("noise", False)]


def test_beside_a_deviation_only_those_are_judged_again_that_gained_something(select):
    least = WORTH_AGAIN * FIRST_GAIN
    _, rounds = select({"a": (200.0, 0.0), "b": (least + 0.1, 9.0), "c": (least - 0.1, 9.0)})
    assert rounds == [["b"]]
    _, rounds = select({"a": (200.0, 20.0), "b": (least + 0.1, 9.0), "c": (least - 0.1, 9.0)})
    assert rounds == [["b", "c"]], "beside an effect that is named all are"


def test_an_effect_that_comes_and_goes_is_the_first_step(select):
    passing = Candidate("wake", (), 60.0, evidence=30.0)
    state, _ = select({"a": (100.0, 20.0)}, passing)
    assert names(state) == [("wake", True), ("a", True)]
    assert state.singles["wake"] is passing and state.least_gain["wake"] == LEAST_GAIN


@pytest.mark.parametrize(("closer", "first"), [(0.9, ("named", True)), (1.1, ("deviation", False))])
def test_a_deviation_goes_before_a_name_only_where_it_gains_more_than_models_may_be_wrong_by(select, closer, first):
    """Two of thousands of nats; the deviation gains `closer` of the share more than what nominal flights lack."""
    named = 20_000.0 * (1.0 - closer * MISFIT_SHARE_DEVIATION)
    state, _ = select({"deviation": (20_000.0, FIRST_GAIN - 0.1), "named": (named, FIRST_GAIN)})
    assert names(state)[0] == first
