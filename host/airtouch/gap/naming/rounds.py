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

FULL = 5  #: variants that are fitted in full, after a first look at all; chosen for time
PROMISING = 0.5  #: of FIRST_GAIN, that one of these must gain at a first look; chosen for time


def round_of(trial: Trial, candidates: Mapping[str, Sequence[Terms]], chosen: Candidate | None,
             progress: Callable[[str], None] = lambda _: None, thorough: bool = False,
             promising: Container[str] = ()) -> dict[str, Candidate]:
    """Every candidate on top of what is chosen: a first look at all, the most promising in full.

    candidates: variants by name; progress: is told every name. thorough: every random effect is fitted, however little
    it promises, and each parameter's strength is that of the variant which frees it alone, since the strength of the
    best of several variants would be biased upwards. promising: names that are judged in full whatever the first look
    says.
    """
    start = start_of(trial, chosen)
    looks = first_looks(start, candidates, progress)
    means = _best_variants(looks.means)
    unpromising, random = random_looks(start, looks.random, means, thorough)
    to_fit, looked_at = _split(means + unpromising, start.gain, promising)
    means_to_fit = [PricedVariant(c.name, c.terms[len(start.terms):], c.choice_cost) for c in to_fit]
    waiting = [*looks.unseen, *random, *means_to_fit]
    if thorough:
        waiting = [v for v in waiting if not _is_tried_alone(v)]
    fitted = map_on_two_cores(lambda v: _fitted(trial, v, chosen, thorough), waiting)
    best = best_of_each([*fitted, *looked_at], len(start.terms))
    if thorough:
        best = {name: _one_by_one(c, [f for f in fitted if f.name == name]) for name, c in best.items()}
    return _with_evidence(trial.data.study.scatter, best, start.gain)


def _fitted(trial: Trial, variant: PricedVariant, chosen: Candidate | None, surely: bool) -> Candidate:
    """A variant fitted on top of what is chosen; one of the loop alone in full only where a brief fit is promising.

    surely: it is fitted in full whatever it promises. Each step of such a fit works out loops anew.
    """
    fit = partial(cross_validated, trial, variant.name, variant.terms, chosen, variant.choice_cost)
    if surely or not all(t.signature.loop_only for t in variant.terms):
        return fit()
    briefly, before = fit(brief=True), chosen.gain if chosen else 0.0
    return fit() if briefly.gain - before > PROMISING * FIRST_GAIN else briefly


def _best_variants(looked: Sequence[Candidate]) -> list[Candidate]:
    """The best of each candidate's variants of one length, best first."""
    best: dict[tuple[str, int], Candidate] = {}
    for look in sorted(looked, key=lambda c: -c.gain):
        best.setdefault((look.name, len(look.terms)), look)
    return list(best.values())


def _split(looked: Sequence[Candidate], gain: float, promising: Container[str],
           ) -> tuple[list[Candidate], list[Candidate]]:
    """Looks, the best of mean effects first, that a fit is worth, and the others.

    gain: nats of what is chosen, over which a look must gain to be among the FULL best; promising: names that need not.
    """
    worth = [look.name in promising or place < FULL and look.gain - gain > PROMISING * FIRST_GAIN
             for place, look in enumerate(looked)]
    pairs = list(zip(looked, worth, strict=True))
    return [look for look, fit in pairs if fit], [look for look, fit in pairs if not fit]


def best_of_each(judged: Sequence[Candidate], before: int) -> dict[str, Candidate]:
    """The best hypothesis of each candidate, on top of so many terms that were there before.

    One with a random part or a companion must earn it, LEAST_GAIN; where its companion alone gains as much, it is that
    which gains.
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
    """A candidate whose parameters (k,) were all tried alone, with the strength that each has there."""
    strengths = [v.strength for v in variants if np.isfinite(v.strength.variance).sum() == 1]
    alone = {int(np.argmin(s.variance)): s for s in strengths}
    if len(alone) < max(len(best.strength.mean), 2):
        return best
    *others, own = best.terms
    strength = Strength(np.array([alone[i].mean[i] for i in range(len(alone))]),
                        np.diag([alone[i].variance[i] for i in range(len(alone))]))
    return replace(best, terms=(*others, replace(own, free=own.signature.free)), strength=strength)


def _with_evidence(scatter: Scatter | None, best: Mapping[str, Candidate], before: float) -> dict[str, Candidate]:
    """Every candidate with its evidence: what it gains over `before`, nats, and no more than its strength says.

    It is at most 0 nats where a parameter lies at a bound: there the effect stands in for another. scatter: of
    strengths in nominal flights; without one a strength says nothing.
    """
    out = {}
    for name, candidate in best.items():
        mine = [t for t in candidate.terms if t.name == name]
        own = strength_term(mine[-2:]) if mine[-1].companion else mine[-1]
        strength = candidate.strength
        stretched = own.shows_in == MEAN and at_bound(own, strength.mean).any()
        rarity = scatter.evidence(name, strength.mean, strength.covariance, strength.apart) if scatter else np.inf
        out[name] = replace(candidate, evidence=min(candidate.gain - before, 0.0 if stretched else rarity))
    return out
