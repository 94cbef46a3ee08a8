"""One round of the selection: every candidate beside the effects that are chosen already.

A first look at every candidate costs little; the most promising are fitted in full.
"""

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from airtouch.gap.naming.judging import FIRST_GAIN, LEAST_GAIN, Trial, at_bound, cross_validated
from airtouch.gap.naming.looks import PricedVariant, first_looks, random_looks, start_of
from airtouch.gap.naming.selection import Candidate, Strength
from airtouch.gap.second_process import map_on_two_cores
from airtouch.gap.signatures.candidates import strength_term
from airtouch.gap.signatures.scatter import Scatter
from airtouch.gap.signatures.signature import COMPANIONS, MEAN
from airtouch.gap.signatures.term import Terms

FULL = 5  #: hypotheses that are fitted in full at most, after a first look at all; chosen for time
#: nats that a hypothesis must gain at a first look, or by a brief fit, to be fitted in full; chosen for time
PROMISING = 0.5 * FIRST_GAIN


def round_of(trial: Trial, candidates: Mapping[str, Sequence[Terms]], chosen: Candidate | None,
             progress: Callable[[str], None] = lambda _: None, thorough: bool = False,
             promising: Container[str] = ()) -> dict[str, Candidate]:
    """The best hypothesis of every candidate beside what is chosen, by name, with its evidence.

    candidates: variants by name; progress: is told every name. thorough: every random effect is fitted, however little
    it promises, and each parameter's strength is that of the variant which frees it alone, since the strength of the
    best of several variants would be biased upwards. promising: names that are judged in full whatever the first look
    says.
    """
    start = start_of(trial, chosen)
    looks = first_looks(start, candidates, progress)
    means = _best_variants(looks.means)
    unpromising, random = random_looks(start, looks.random, means, thorough)
    to_fit, looked_at = _by_promise(means + unpromising, start.gain, promising)
    means_to_fit = [PricedVariant(c.name, c.terms[len(start.terms):], c.charges.choice_cost) for c in to_fit]
    variants = [*looks.unseen, *random, *means_to_fit]
    if thorough:
        variants = [v for v in variants if not _is_tried_alone(v)]
    fitted = map_on_two_cores(lambda v: _fitted(trial, v, chosen, in_full=thorough), variants)
    best = best_of_each([*fitted, *looked_at], len(start.terms))
    if thorough:
        best = {name: _one_by_one(c, [f for f in fitted if f.name == name]) for name, c in best.items()}
    return _with_evidence(trial.data.study.scatter, best, start.gain)


def _fitted(trial: Trial, variant: PricedVariant, chosen: Candidate | None, in_full: bool) -> Candidate:
    """A variant fitted beside what is chosen.

    An effect of the loop alone, of which each step of a fit works out loops anew, is fitted briefly first, and in full
    where that promises something, or where `in_full`.
    """
    fit = partial(cross_validated, trial, variant.name, variant.terms, chosen, variant.choice_cost)
    if in_full or not all(t.signature.loop_only for t in variant.terms):
        return fit()
    briefly, before = fit(brief=True), chosen.gain if chosen else 0.0
    return fit() if briefly.gain - before > PROMISING else briefly


def _best_variants(looked: Sequence[Candidate]) -> list[Candidate]:
    """The best variant of each name and number of terms, best first."""
    best: dict[tuple[str, int], Candidate] = {}
    for look in sorted(looked, key=lambda c: -c.gain):
        best.setdefault((look.name, len(look.terms)), look)
    return list(best.values())


def _by_promise(looked_at: Sequence[Candidate], gain: float, promising: Container[str],
                ) -> tuple[list[Candidate], list[Candidate]]:
    """The hypotheses that are worth a full fit, and the others.

    looked_at: by a first look, those of mean effects first, the best first: of the first FULL those are worth a fit
    that gain PROMISING over the gain of what is chosen, nats; promising: names that are worth one at any gain.
    """
    worth_a_fit, others = [], []
    for place, candidate in enumerate(looked_at):
        gains_enough = place < FULL and candidate.gain - gain > PROMISING
        (worth_a_fit if gains_enough or candidate.name in promising else others).append(candidate)
    return worth_a_fit, others


def best_of_each(judged: Sequence[Candidate], before: int) -> dict[str, Candidate]:
    """The best hypothesis of each candidate, by name.

    before: number of terms that were chosen before. A random part or a companion must add LEAST_GAIN; where its
    companion alone gains nearly as much as both, the effect is put LEAST_GAIN behind it.
    """
    best: dict[str, Candidate] = {}
    for new in sorted(judged, key=lambda c: len(c.terms)):
        old = best.get(new.name)
        need = LEAST_GAIN if old is not None and len(new.terms) > len(old.terms) else 0.0
        if old is None or (new.full, new.gain) > (old.full, old.gain + need):
            best[new.name] = new
    for name, other in COMPANIONS.items():
        both, alone = best.get(name), best.get(other)
        if both and alone and len(both.terms) > before + 1 and both.gain < alone.gain + LEAST_GAIN:
            best[name] = replace(both, gain=min(both.gain, alone.gain - LEAST_GAIN))
    return best


def _is_tried_alone(variant: PricedVariant) -> bool:
    """Whether a variant frees several parameters each of which another variant frees alone."""
    own = variant.terms[0]
    return own.signature.alone_too and len(own.free) > 1


def _one_by_one(best: Candidate, variants: Sequence[Candidate]) -> Candidate:
    """A candidate with the strength that each of its k parameters has where it is free alone, and all of them free.

    variants: its fitted variants. It stays as it is where not each of several parameters was tried alone.
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


def _with_evidence(scatter: Scatter | None, best: Mapping[str, Candidate], before: float) -> dict[str, Candidate]:
    """Every candidate with its evidence: nats that it gains over `before`, but no more than its strength says.

    It is at most 0 nats where a parameter lies at a bound: there the effect stands in for another. scatter: of
    strengths in nominal flights; without one a strength says nothing.
    """
    out = {}
    for name, candidate in best.items():
        of_its_name = [t for t in candidate.terms if t.name == name]
        own = strength_term(of_its_name[-2:]) if of_its_name[-1].companion else of_its_name[-1]
        strength = candidate.strength
        stretched = own.shows_in == MEAN and at_bound(own, strength.mean).any()
        rarity = scatter.evidence(name, strength.mean, strength.covariance, strength.apart) if scatter else np.inf
        out[name] = replace(candidate, evidence=min(candidate.gain - before, 0.0 if stretched else rarity))
    return out
