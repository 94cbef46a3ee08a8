"""Which effect: candidates are judged one against another and added one by one while held-out data ask for them.

`none` is the hypothesis of no effect. `unknown` is the answer where too much speaks against the effects named, on one
of three grounds (`naming.unknown`). The first of them is the nameless model (`gap.nameless.model`): it needs more
parameters, so a named effect that is right beats it, and what it gains beside the named effects they do not explain.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.sensing import unexplained_outside
from airtouch.gap.nameless.model import held_out_gains
from airtouch.gap.naming.by_relations import inference_of, selection_by_relations
from airtouch.gap.naming.forward import PartialSelection, Search, forward
from airtouch.gap.naming.judging import Trial, trial_of
from airtouch.gap.naming.leave_one_out import with_leave_one_out_gains
from airtouch.gap.naming.over_prediction import over_prediction_of
from airtouch.gap.naming.passing_effect import (
    as_in_nominal_flights,
    outgained,
    passing_effect,
    unsteadiness_rarity,
    unusual_passing_effects,
)
from airtouch.gap.naming.policy import WAKE_SHARE
from airtouch.gap.naming.records import Hypothesis, NamelessGain, Selection
from airtouch.gap.naming.thresholds import assumes
from airtouch.gap.naming.unknown import is_explained
from airtouch.gap.passing.gates import PassingEffect
from airtouch.gap.relations.inference import Inference
from airtouch.gap.second_process import map_on_two_cores
from airtouch.gap.signatures.candidates import random_of
from airtouch.gap.signatures.signature import OVERHEAD
from airtouch.gap.signatures.term import Terms
from airtouch.simulation import effects

PACKAGE_EFFECTS = frozenset(effects.NAMES)  #: names of the package's effects; others are a user's own


def select(data: Data, candidates: Mapping[str, Sequence[Terms]],
           progress: Callable[[str], None] = lambda _: None, without: Sequence[str] = (), rank_all: bool = True,
           ) -> Selection:
    """The selection of effects among candidates: they are judged, then effects are named.

    1. Where no library of the signals' relations holds for the flights, the replay names the effects (`_by_replay`).
    2. Where one holds, its inference names them (`_by_relations`).
    3. Where one holds and a user's own effect is a candidate, the replay's answer stands if it names that effect first
       and leaves nothing unexplained: the effect's class was learned from few flights. Else as in 2.

    candidates: the variants of every effect by name; progress: called with the name of every candidate that is judged;
    without: effects that are not searched for as passing ones; rank_all: judge every candidate alone also where
    the relations name the effects, as the ranking needs for the share of the gap that each closes; else only those that
    are named are fitted there. The replay always judges every one alone.
    """
    search = Search(trial_of(data), candidates, progress)
    inference = inference_of(data, list(candidates))
    if inference is not None and PACKAGE_EFFECTS.issuperset(candidates):
        return _by_relations(search, inference, without, rank_all)
    unusual = unusual_passing_effects(search, without)
    answer = _by_replay(search, _search_effects(search, passing_effect(search, unusual)), unusual)
    if inference is None:
        return answer
    if _own_effect_explains(answer):
        return replace(answer, library_holds=True)
    return _by_relations(search, inference, without, rank_all)


def _own_effect_explains(answer: Selection) -> bool:
    """Whether a user's own effect is named first, and nothing is left unexplained."""
    first = next(iter(answer.named_steps), None)
    return first is not None and first.name not in PACKAGE_EFFECTS and is_explained(answer)


def _by_relations(search: Search, inference: Inference, without: Sequence[str], rank_all: bool) -> Selection:
    """What the relations of signals name; where these leave something unexplained, what the replay may name instead.

    The replay is asked where `replay_may_name`. Its answer stands if the first effect that it names is a wake, or the
    likeliest by the relations.
    """
    answer = selection_by_relations(search, inference, rank_all)
    if is_explained(answer):
        return answer
    unusual = unusual_passing_effects(search, without)
    passing = passing_effect(search, unusual)
    if not replay_may_name(passing, inference):
        return answer
    partial = _search_effects(search, passing)
    if next(iter(partial.names), "") not in (OVERHEAD, inference.likeliest):
        return answer
    return replace(_by_replay(search, partial, unusual), library_holds=True)


def replay_may_name(passing: Hypothesis | None, inference: Inference) -> bool:
    """Whether the replay is asked where the relations leave something unexplained. passing: the passing effect, if any.

    It is asked in three cases, the first two of a passing effect:

    1. it is a wake: the relations of a whole flight dilute its seconds;
    2. it is the effect for which the relations have most evidence;
    3. for a wake that fills the flight they have more than WAKE_SHARE of that evidence, nats.
    """
    if passing is not None and passing.name in (OVERHEAD, inference.likeliest):
        return True
    most = inference.evidence.get(inference.likeliest, 0.0)
    return inference.evidence.get(OVERHEAD, -np.inf) > WAKE_SHARE * most


def _search_effects(search: Search, passing: Hypothesis | None) -> PartialSelection:
    """Where a forward search ends, its steps with their leave-one-out gains.

    passing: the passing effect, its first step; the search is done again without it where beside the other effects it
    is no more than nominal flights have.
    """
    trial, partial = search.trial, forward(search, passing)
    steps = with_leave_one_out_gains(trial, partial.steps)
    if passing is not None and as_in_nominal_flights(trial.data, passing, steps):
        partial = forward(search, None)
        steps = with_leave_one_out_gains(trial, partial.steps)
    return replace(partial, steps=tuple(steps))


def _by_replay(search: Search, partial: PartialSelection, unusual: Sequence[PassingEffect]) -> Selection:
    """The selection that a search ended in, with what it leaves. unusual: `unusual_passing_effects`."""
    trial, policy, steps = search.trial, search.trial.policy, partial.steps
    last = steps[-1].terms if steps else ()
    over_none, *over_steps = map_on_two_cores(lambda base: nameless_nats(trial, base), (None, *steps[-1:]))
    over_last_step = over_steps[0] if steps else over_none
    selection = Selection(
        single_effects=partial.single_effects, steps=steps, halves=trial.halves, least_nats=partial.least_nats,
        nameless=NamelessGain(over_none, over_last_step, unexplained_outside(trial.data, last)),
        spectrum_is_assumed=assumes(trial.data, last) if policy.loop_is_assumed else bool(random_of(last)),
        policy=policy, outgained=outgained(search, unusual))
    if policy.judges_unsteadiness:
        selection = replace(selection, unsteadiness_rarity=unsteadiness_rarity(trial.data))
    if policy.judges_over_prediction:
        selection = replace(selection, over_prediction=over_prediction_of(trial, selection.named_hypothesis))
    return selection


def nameless_nats(trial: Trial, base: Hypothesis | None) -> float:
    """Held-out nats that the nameless model adds to a hypothesis, with those of logged times and echo of noise."""
    fits = [f.terms for f in base.fits] if base and base.fits else [(), ()]
    of_spectra = max(sum(held_out_gains(trial.data, trial.halves, fits)), 0.0)
    return of_spectra + unexplained_outside(trial.data, base.terms if base else ())

