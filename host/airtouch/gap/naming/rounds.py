"""One round of the selection: every candidate beside the hypothesis so far, its base.

Screening every candidate costs little; the most promising are fitted in full.
"""

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from airtouch.gap.naming.evidence import with_evidence
from airtouch.gap.naming.judging import PricedVariant, Trial, cross_validated
from airtouch.gap.naming.policy import BEST_SCREENED, BRIEF_SHARE, COMPANION_GAIN, FIRST_GAIN, LONGER_GAIN, PROMISING
from airtouch.gap.naming.records import Hypothesis, Strength
from airtouch.gap.naming.screening.screen import RoundStart, screen_random, screen_variants, start_of
from airtouch.gap.naming.thresholds import is_random_misfit, least_further_gain
from airtouch.gap.second_process import map_on_two_cores
from airtouch.gap.signatures.signature import COMPANIONS
from airtouch.gap.signatures.term import Terms


def round_of(trial: Trial, candidates: Mapping[str, Sequence[Terms]], base: Hypothesis | None,
             progress: Callable[[str], None] = lambda _: None, promising: Container[str] = ()) -> dict[str, Hypothesis]:
    """The best hypothesis of every candidate beside a base, by name, with its evidence: see `best_beside`."""
    best = best_beside(trial, candidates, base, progress, promising)
    return with_evidence(trial.data, best, base.gain if base else 0.0)


def best_beside(trial: Trial, candidates: Mapping[str, Sequence[Terms]], base: Hypothesis | None,
                progress: Callable[[str], None] = lambda _: None, promising: Container[str] = (),
                ) -> dict[str, Hypothesis]:
    """The best hypothesis of every candidate beside a base, by name, without evidence.

    candidates: variants by name; base: None for no effect; progress: called with every name; promising: names that are
    judged in full whatever screening says.
    """
    start = start_of(trial, base)
    variants, not_fitted = _screen(start, candidates, progress, promising)
    fitted = map_on_two_cores(partial(_fit_variant, start, promising),
                              _without_hopeless_parts(start, variants, promising))
    return best_of_each(trial, [*fitted, *not_fitted], len(start.terms))


def every_strength(trial: Trial, candidates: Mapping[str, Sequence[Terms]]) -> dict[str, Hypothesis]:
    """The best hypothesis of every candidate alone, by name, for the strength that it seems to have; no evidence.

    Every random effect is fitted, and every fit is one in full. Each parameter's strength is that of the variant which
    frees it alone, since the strength of the best of several variants would be biased upwards. candidates: variants by
    name.
    """
    variants, not_fitted = _screen(start_of(trial, None), candidates, every_random=True)
    one_by_one = [v for v in variants if not _is_tried_alone(v)]
    fitted = map_on_two_cores(lambda v: cross_validated(trial, v, None), one_by_one)
    best = best_of_each(trial, [*fitted, *not_fitted], 0)
    return {name: _one_by_one(c, [f for f in fitted if f.name == name]) for name, c in best.items()}


def _screen(start: RoundStart, candidates: Mapping[str, Sequence[Terms]],
            progress: Callable[[str], None] = lambda _: None, promising: Container[str] = (),
            every_random: bool = False) -> tuple[list[PricedVariant], list[Hypothesis]]:
    """The variants that are worth a fit, and hypotheses of the others.

    candidates, progress, promising: as for `round_of`; every_random: as for `screen_random`.
    """
    screened = screen_variants(start, candidates, progress)
    means = sorted(screened.means, key=lambda c: -c.gain)
    unpromising, random = screen_random(start, screened.random, means, every_random)
    to_fit, not_fitted = _by_promise(_best_variants(means) + unpromising, start.gain, promising)
    means_to_fit = [PricedVariant(c.name, c.terms[len(start.terms):], c.charges.newest_choice_cost) for c in to_fit]
    return [*screened.fit_only, *random, *means_to_fit], not_fitted


def _without_hopeless_parts(start: RoundStart, variants: Sequence[PricedVariant], promising: Container[str],
                            ) -> list[PricedVariant]:
    """The variants without those of one parameter of an effect of the loop whose parameters together gain little.

    By a brief fit these gain PROMISING nats at most; promising: names of effects that are kept at any gain.
    """
    hopeless = {v.name for v in variants if _is_tried_alone(v) and _of_loop_alone(v) and v.name not in promising
                and cross_validated(start.trial, v, start.base, brief=True).gain - start.gain <= PROMISING}
    return [v for v in variants if v.name not in hopeless or _is_tried_alone(v)]


def _fit_variant(start: RoundStart, promising: Container[str], variant: PricedVariant) -> Hypothesis:
    """A variant fitted beside the base of a round.

    An effect of the loop alone, of which each step of a fit works out loops anew, is fitted briefly first, and in full
    where it may then gain what it must: BRIEF_SHARE of that, less PROMISING. promising: names of effects that are
    fitted in full at any gain.
    """
    fit = partial(cross_validated, start.trial, variant, start.base)
    if not _of_loop_alone(variant) or variant.name in promising:
        return fit()
    briefly = fit(brief=True)
    required = least_further_gain(start.trial, start.base, briefly) if start.base else FIRST_GAIN
    promises = briefly.gain - start.gain > max(PROMISING, BRIEF_SHARE * required - PROMISING)
    return fit(near=briefly) if promises else briefly


def _of_loop_alone(variant: PricedVariant) -> bool:
    """Whether a variant changes the loop alone."""
    return all(t.signature.loop_only for t in variant.terms)


def _best_variants(means: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The best variant of each name and number of terms, best first, as `means` are."""
    best: dict[tuple[str, int], Hypothesis] = {}
    for hypothesis in means:
        best.setdefault((hypothesis.name, len(hypothesis.terms)), hypothesis)
    return list(best.values())


def _by_promise(screened: Sequence[Hypothesis], gain: float, promising: Container[str],
                ) -> tuple[list[Hypothesis], list[Hypothesis]]:
    """The hypotheses that are worth a full fit, and the others.

    screened: to first order, those of mean effects first, the best first: of the first BEST_SCREENED those are worth a
    fit that gain PROMISING over the gain of the base, nats; promising: names that are worth one at any gain.
    """
    worth_a_fit, others = [], []
    for rank, hypothesis in enumerate(screened):
        gains_enough = rank < BEST_SCREENED and hypothesis.gain - gain > PROMISING
        (worth_a_fit if gains_enough or hypothesis.name in promising else others).append(hypothesis)
    return worth_a_fit, others


def best_of_each(trial: Trial, hypotheses: Sequence[Hypothesis], before: int) -> dict[str, Hypothesis]:
    """The best hypothesis of each candidate, by name, those that only their companion carries put behind it.

    before: number of terms of the base.
    """
    best: dict[str, Hypothesis] = {}
    for new in sorted(hypotheses, key=lambda h: len(h.terms)):
        old = best.get(new.name)
        if old is None or _is_better(new, old):
            best[new.name] = new
    return _behind_companion(trial, best, before)


def _behind_companion(trial: Trial, best: Mapping[str, Hypothesis], before: int) -> dict[str, Hypothesis]:
    """The best hypotheses by name, with the gain of an effect lowered where its companion alone gains nearly as much.

    Beside its companion an effect must gain what a further effect must gain to be named. One that gains less explains
    little itself: its gain is put COMPANION_GAIN behind that of the companion, so that the companion is taken. before:
    number of terms of the base.
    """
    out = dict(best)
    for name, other in COMPANIONS.items():
        both, alone = out.get(name), out.get(other)
        if both and alone and len(both.terms) > before + 1 and _explains_little(trial, alone, both):
            out[name] = replace(both, gain=min(both.gain, alone.gain - COMPANION_GAIN))
    return out


def _explains_little(trial: Trial, alone: Hypothesis, both: Hypothesis) -> bool:
    """Whether an effect with its companion gains less over the companion alone than a further effect needs."""
    return both.gain - alone.gain < least_further_gain(trial, alone, both) or is_random_misfit(trial, alone, both)


def _is_better(new: Hypothesis, old: Hypothesis) -> bool:
    """Whether a hypothesis of a candidate replaces another with no more terms.

    One that is fitted in full replaces one that is not; else one that gains more, by LONGER_GAIN if it has more terms,
    a random part or a companion.
    """
    if new.full != old.full:
        return new.full
    margin = LONGER_GAIN if len(new.terms) > len(old.terms) else 0.0
    return new.gain > old.gain + margin


def _is_tried_alone(variant: PricedVariant) -> bool:
    """Whether a variant frees several parameters each of which another variant frees alone."""
    own = variant.terms[0]
    return own.signature.alone_too and len(own.free) > 1


def _one_by_one(best: Hypothesis, variants: Sequence[Hypothesis]) -> Hypothesis:
    """The best hypothesis of a candidate, with the strength that each of its k parameters has where it is free alone.

    All of them are free in it. variants: of the candidate, as fitted. The hypothesis stays as it is where not each of
    several parameters was tried alone.
    """
    of_one_parameter = [v.strength for v in variants if np.isfinite(v.strength.variance).sum() == 1]
    alone = {int(np.argmin(s.variance)): s for s in of_one_parameter}  # of another parameter the variance is infinite
    k = len(alone)
    if k < max(len(best.strength.mean), 2):
        return best
    *others, own = best.terms
    strength = Strength(np.array([alone[i].mean[i] for i in range(k)]),
                        np.diag([alone[i].variance[i] for i in range(k)]))
    return replace(best, terms=(*others, replace(own, free=own.signature.free)), strength=strength)

