"""Forward selection on candidates whose gain and evidence a test makes up: which are added, and which have a name."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
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
    policy_of,
)
from airtouch.gap.naming.records import Hypothesis
from hovers import DOWN, scattered, select_from, weak

POLICY = policy_of(scattered(exact=True), 30.0)  #: of simulated flights


@pytest.fixture
def select(monkeypatch):
    """A selection among candidates {name: (own gain, evidence)}, which gain as much beside others as alone.

    Returns the partial selection, and the names that were judged in each round.
    """
    def run(candidates, passing=None, screened=(), least_evidence=FIRST_GAIN):
        def candidate(name, base_gain=0.0):
            gain, evidence = candidates[name]
            return Hypothesis(name, (), base_gain + gain, full=name not in screened, evidence=evidence)

        def round_of(trial, variants, base, progress, promising=()):
            if base is None:
                return {n: candidate(n) for n in variants}
            added.append(base.name)
            rounds.append([n for n in variants if n not in added])
            return {n: candidate(n, base.gain) for n in rounds[-1]}

        rounds, added = [], []
        monkeypatch.setattr(module, "round_of", round_of)
        monkeypatch.setattr(module, "best_beside", round_of)
        monkeypatch.setattr(module, "with_evidence", lambda data, best, base_gain: best)
        trial = SimpleNamespace(policy=replace(POLICY, least_evidence=least_evidence),
                                data=SimpleNamespace(study=SimpleNamespace(loop=None)))
        return forward(Search(trial, dict.fromkeys(candidates, [()]), lambda _: None), passing), rounds

    return run


def names(partial):
    return [(s.name, s.is_named) for s in partial.steps]


def test_the_largest_gain_is_added_first_up_to_most_effects(select):
    partial, _ = select({n: (100.0 * k, 20.0) for k, n in enumerate("abcde", 1)})
    assert names(partial) == [("e", True), ("d", True), ("c", True)] and len(partial.steps) == MOST_EFFECTS
    assert partial.gain == 1200.0


def test_a_small_gain_or_a_screened_candidate_is_not_added(select):
    partial, _ = select({"a": (FIRST_GAIN - 0.1, 20.0), "b": (100.0, 20.0)}, screened=("b",))
    assert partial.steps == () and partial.gain == 0.0
    partial, _ = select({"a": (50.0, 20.0), "b": (LEAST_GAIN - 0.1, 20.0)})
    assert names(partial) == [("a", True)], "beside another it needs more"


def test_evidence_decides_a_close_race_up_to_certain(select):
    assert names(select({"a": (103.0, 10.0), "b": (100.0, 15.0)})[0])[0][0] == "b"
    assert names(select({"a": (103.0, 20.0), "b": (100.0, 90.0)})[0])[0][0] == "a"


def test_three_deviations_are_added_and_no_more(select):
    deviations = {n: (200.0 + k, FIRST_GAIN - 0.1) for k, n in enumerate("abcde")}
    partial, _ = select(deviations)
    assert names(partial) == [("e", False), ("d", False), ("c", False)] and partial.deviations == MOST_DEVIATIONS
    partial, _ = select({**deviations, "f": (30.0, FIRST_GAIN)})
    assert names(partial)[3:] == [("f", True)] and partial.names == ["f"]


def test_first_name_beside_a_deviation_needs_as_much_gain_as_evidence(select):
    judged = {"deviation": (200.0, 0.0), "named": (LEAST_GAIN - 0.1, LEAST_GAIN)}
    assert names(select(judged)[0]) == [("deviation", False), ("named", True)]
    assert names(select(judged, least_evidence=LEAST_GAIN)[0]) == [("deviation", False)]


def test_how_much_evidence_names_an_effect_depends_on_the_flights(select):
    judged = {"effect": (100.0, FIRST_GAIN)}
    assert names(select(judged)[0]) == [("effect", True)]
    assert names(select(judged, least_evidence=LEAST_GAIN)[0]) == [("effect", False)]


def test_random_misfit_is_a_deviation(select):
    deviations = {n: (400.0 + k, FIRST_GAIN - 0.1) for k, n in enumerate("abcde")}
    evident = {"f": (150.0, 20.0), "imu_noise": (140.0, 20.0)}
    partial, _ = select({**deviations, **evident})
    assert names(partial) == [("e", False), ("d", False), ("c", False), ("f", True), ("imu_noise", False)]


def test_small_gains_are_not_judged_again_beside_a_deviation(select):
    least = WORTH_AGAIN * FIRST_GAIN
    _, rounds = select({"a": (200.0, 0.0), "b": (least + 0.1, 9.0), "c": (least - 0.1, 9.0)})
    assert rounds == [["b"]]
    _, rounds = select({"a": (200.0, 20.0), "b": (least + 0.1, 9.0), "c": (least - 0.1, 9.0)})
    assert rounds == [["b", "c"]], "beside an effect that is named all are"
    _, rounds = select({"a": (900.0, 20.0), "b": (least + 0.1, 9.0), "c": (least - 0.1, 9.0), "d": (200.0, 0.0)})
    assert rounds == [["b", "c", "d"], ["b"]], "d is a deviation beside a named effect"


def test_passing_effect_is_the_first_step(select):
    passing = Hypothesis("wake", (), 60.0, evidence=30.0)
    partial, _ = select({"a": (100.0, 20.0)}, passing)
    assert names(partial) == [("wake", True), ("a", True)]
    assert partial.single_effects["wake"] is passing and partial.least_nats["wake"] == LEAST_GAIN


@pytest.mark.parametrize(("closer", "first"), [(0.9, ("named", True)), (1.1, ("deviation", False))])
def test_deviation_goes_before_a_name_by_a_misfit_share(select, closer, first):
    """Two of thousands of nats; the deviation gains `closer` of the share more than what nominal flights lack."""
    named = 20_000.0 * (1.0 - closer * MISFIT_SHARE_DEVIATION)
    partial, _ = select({"deviation": (20_000.0, FIRST_GAIN - 0.1), "named": (named, FIRST_GAIN)})
    assert names(partial)[0] == first


@pytest.mark.parametrize("nominal_loss", [True, False])
def test_three_deviations_then_evidence_alone(nominal_loss):
    """Four effects: lost rows, which gain least, where nominal flights lose as many as well, and where none does."""
    flight = weak(r2=0.004, louder=1.3)
    flight = replace(flight, acceleration=flight.acceleration - [0.0, 0.0, DOWN],
                     lost=np.random.default_rng(0).random(2000) < 0.02)
    rms = {"mass": [3.0], "weak_motor": [30.0], "imu_noise": [30.0], "packet_loss": [30.0]}
    study = scattered(**{n: r for n, r in rms.items() if n != "packet_loss" or nominal_loss})
    selection, _ = select_from([flight], tuple(rms), study)
    names = ["weak_motor", "mass", "imu_noise"] + ["packet_loss"] * (not nominal_loss)
    assert [(s.name, s.is_named) for s in selection.steps] == [(n, n == "packet_loss") for n in names]
    beside = {n: [t.name for t in j.terms] for n, j in selection.single_effects.items()}
    assert beside["weak_motor"] == names[:1] and beside["mass"] == names[:2] and beside["imu_noise"] == names[:3]
    assert beside["packet_loss"] == [*names[:2 if nominal_loss else 3], "packet_loss"], "as judged before the last step"
