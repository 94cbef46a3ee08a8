"""The effects that the relations of signals name, fitted and judged as every other hypothesis is."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.features.flight_features import features
from airtouch.gap.naming.forward import Search
from airtouch.gap.naming.records import Hypothesis, NamelessGain, Selection, Step
from airtouch.gap.naming.rounds import best_beside
from airtouch.gap.relations.effect_class import EffectClass
from airtouch.gap.relations.inference import Inference, infer
from airtouch.gap.signatures.term import Terms


def inference_of(data: Data, names: Sequence[str]) -> Inference | None:
    """What the relations of signals say of flights, among these effects.

    None where no library holds for the study's nominal flights, where it lacks an effect, or a log a column.
    """
    library = data.study.relations
    if library is None or not data.study.simulated or not set(names) <= library.effects:
        return None
    own = [features(f, data.study.vehicle) for f in data.flights]
    known = [f for f in own if f is not None]
    if len(known) < len(own):
        return None
    return infer(library.without(library.effects - set(names)), library.coordinates(np.array(known)))


def selection_by_relations(search: Search, inference: Inference, rank_all: bool = True) -> Selection:
    """The selection of the effects that an inference names, each fitted beside those before it.

    Their evidence is that of the relations; the others have none, so that no scatter of nominal flights is needed.

    rank_all: with every candidate judged alone; else those stand in it as not fitted.
    """
    steps: list[Step] = []
    for effect in dict.fromkeys(c.effect for c in inference.classes):
        own, all_variants = [c for c in inference.classes if c.effect == effect], search.candidates[effect]
        variants = {effect: matching(own[0], all_variants) if len(own) == 1 else list(all_variants)}
        judged = best_beside(search.trial, variants, steps[-1] if steps else None, search.progress, (effect,))
        if effect in judged:
            steps.append(Step.of(replace(judged[effect], evidence=inference.evidence[effect])))
    not_fitted = {name: Hypothesis(name, (), 0.0, full=False) for name in search.candidates}
    return Selection(
        single_effects=search.fitted_alone if rank_all else not_fitted, steps=tuple(steps), nameless=NamelessGain(),
        halves=search.trial.halves, least_nats=search.least_nats, spectrum_is_assumed=False,
        inference=inference, library_holds=True, policy=search.trial.policy)


def matching(effect_class: EffectClass, variants: Sequence[Terms]) -> list[Terms]:
    """The variants of an effect that are of a class: with its shape, or with the one parameter that it is named by."""
    if effect_class.own_parameter is not None:
        return [v for v in variants if v[0].free == (effect_class.own_parameter,)]
    if effect_class.shape is None:
        return list(variants)
    return [v for v in variants if v[0].values[v[0].signature.class_by] == effect_class.shape]
