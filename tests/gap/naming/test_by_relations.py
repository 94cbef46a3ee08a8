"""The effects that the relations of signals name: which variants are fitted, and when the replay is asked instead."""

from dataclasses import replace

import numpy as np
import pytest

from airtouch.gap.evidence.counterevidence import Counterevidence
from airtouch.gap.evidence.data import Data
from airtouch.gap.naming import select
from airtouch.gap.naming.by_relations import matching, selection_by_relations
from airtouch.gap.naming.forward import Search
from airtouch.gap.naming.judging import trial_of
from airtouch.gap.naming.unknown import is_explained
from airtouch.gap.relations.effect_class import EffectClass
from airtouch.gap.relations.inference import Inference
from airtouch.gap.signatures.candidates import all_candidates
from airtouch.gap.study import ScatterOnDemand
from hovers import DOWN, FLOOR, candidates_of, hover, scattered, with_a_push

EXPLAINED, OPEN = Counterevidence(1.0, 30.0, of_distance=False), Counterevidence(90.0, 30.0, of_distance=False)


def effect_class(effect, name=None, shape=None):
    """A class whose curve is not asked for here."""
    none = np.zeros((1, 0))
    return EffectClass(name or effect, effect, shape, 1, False, np.zeros(2), np.zeros((1, 2, 1)), none, none[0])


def inference(classes=(), counterevidence=EXPLAINED, likeliest="mass"):
    """An inference with most evidence for one effect."""
    evidence = {c.effect: 20.0 for c in classes} | {likeliest: 100.0}
    return Inference(tuple(classes), evidence, counterevidence)


def test_matching_by_parameter():
    variants = all_candidates()["controller_gain"]
    (only,) = matching(effect_class("controller_gain", "controller_gain attitude"), variants)
    assert only[0].free == ("attitude",)


def test_matching_by_shape():
    variants = all_candidates()["weak_motor"]
    (only,) = matching(effect_class("weak_motor", shape=3.0), variants)
    assert only[0].values["rotor"] == 3.0
    assert matching(effect_class("weak_motor"), variants) == list(variants), "of any shape"


def test_selection_has_a_step_for_each_effect_with_its_evidence():
    """A push and loud noise: both are fitted, each beside those before it, and named whatever they gain."""
    data = Data(FLOOR, [hover(1, (0.0, 0.0, -DOWN), louder=1.5)])
    inferred = inference([effect_class("imu_noise"), effect_class("mass")], likeliest="imu_noise")
    search = Search(trial_of(data), candidates_of(["mass", "imu_noise"]), lambda _: None)
    selection = selection_by_relations(search, inferred)
    assert [(s.name, s.is_named, s.evidence) for s in selection.steps] == [("imu_noise", True, 100.0),
                                                                        ("mass", True, 20.0)]
    assert {t.name for t in selection.last_step.terms} == {"mass", "imu_noise"}
    assert selection.inference is inferred and is_explained(selection)


def test_where_the_relations_explain_no_scatter_is_asked_for(monkeypatch):
    """Its measuring takes seconds; the answer and the other candidates do without."""
    def never():
        raise AssertionError("the scatter was measured")

    study = replace(FLOOR, simulated=True, nominal_count=2, on_demand=ScatterOnDemand(never))
    monkeypatch.setattr(select, "inference_of", lambda *_: inference([effect_class("mass")]))
    monkeypatch.setattr(select, "PACKAGE_EFFECTS", frozenset(("mass", "imu_noise")))
    data = Data(study, [hover(1, (0.0, 0.0, -DOWN))])
    selection = select.select(data, candidates_of(["mass", "imu_noise"]))
    assert [s.name for s in selection.named_steps] == ["mass"] and selection.single_effects["imu_noise"].evidence == 0.0


@pytest.fixture
def relations(monkeypatch):
    """Makes the relations of signals hold for the flights, and give an inference."""
    def hold(inferred):
        monkeypatch.setattr(select, "inference_of", lambda data, names: inferred)
    return hold


PUSHED = Data(scattered(), [with_a_push(9.0, 15.0)])  #: a push of some seconds, which a wake explains


@pytest.mark.parametrize("counterevidence", [EXPLAINED, OPEN])
def test_relations_name_what_always_acts(relations, counterevidence):
    """The replay is not asked where no effect passes, explained or not."""
    inferred = inference([effect_class("mass")], counterevidence)
    relations(inferred)
    selection = select.select(Data(FLOOR, [hover(1, (0.0, 0.0, -DOWN))]), candidates_of(["mass"]))
    assert selection.inference is inferred and [s.name for s in selection.named_steps] == ["mass"]
    assert selection.single_effects["mass"].gain > 100.0


def test_without_a_whole_ranking_no_candidate_is_judged_alone(relations):
    relations(inference([effect_class("mass")]))
    data, candidates = Data(FLOOR, [hover(1, (0.0, 0.0, -DOWN))]), candidates_of(["mass", "imu_bias"])
    judged = []
    whole, short = (select.select(data, candidates, judged.append, rank_all=every) for every in (True, False))
    assert judged == ["mass", "mass", "imu_bias", "mass"], "for a name, for the whole ranking, for a name"
    assert [s.terms for s in short.steps] == [s.terms for s in whole.steps]
    assert list(short.single_effects) == list(whole.single_effects)
    assert not any(c.full for c in short.single_effects.values())


@pytest.mark.parametrize(("counterevidence", "likeliest", "by_replay"), [
    (EXPLAINED, "downwash", False), (OPEN, "downwash", True), (OPEN, "mass", True)])
def test_replay_names_a_wake_that_relations_leave_open(relations, counterevidence, likeliest, by_replay):
    relations(inference([effect_class("mass")], counterevidence, likeliest))
    selection = select.select(PUSHED, candidates_of(["mass"]))
    assert (selection.inference is None) is by_replay
    assert [s.name for s in selection.named_steps] == (["downwash"] if by_replay else ["mass"])


def test_replay_names_no_wind_that_is_not_the_likeliest(relations, monkeypatch):
    passing = select.passing_effect
    monkeypatch.setattr(select, "passing_effect", lambda *arguments: replace(passing(*arguments), name="wind"))
    relations(inference([effect_class("mass")], OPEN))
    assert select.select(PUSHED, candidates_of(["mass"])).inference is not None


def test_relations_stand_where_the_replay_takes_its_wake_back(relations, monkeypatch):
    """What it then names instead is asked for again: no wake, and not the likeliest."""
    monkeypatch.setattr(select, "as_in_nominal_flights", lambda *_: True)
    relations(inference([effect_class("mass")], OPEN, "downwash"))
    assert select.select(PUSHED, candidates_of(["mass"])).inference is not None
