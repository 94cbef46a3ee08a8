"""One round of the selection: every candidate beside the effects that are chosen already.

A first look at every candidate costs little; the most promising are fitted in full.
"""

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import replace

import numpy as np

from airtouch.gap.naming.judging import FIRST_GAIN, LEAST_GAIN, Trial, at_bound, cross_validated
from airtouch.gap.naming.looks import PricedVariant, first_looks, random_looks, start_of
from airtouch.gap.naming.selection import Candidate
from airtouch.gap.second_process import map_on_two_cores
from airtouch.gap.signatures.candidates import strength_term
from airtouch.gap.signatures.scatter import Scatter
from airtouch.gap.signatures.signature import COMPANIONS, MEAN
from airtouch.gap.signatures.term import Terms

FULL = 5  #: variants that are fitted in full, after a first look at all; chosen for time
PROMISING = 0.5  #: of FIRST_GAIN, that one of these must gain at a first look; chosen for time


def round_of(on: Trial, candidates: Mapping[str, Sequence[Terms]], chosen: Candidate | None,
             progress: Callable[[str], None] = lambda _: None, thorough: bool = False,
             promising: Container[str] = ()) -> dict[str, Candidate]:
    """Every candidate on top of what is chosen: a first look at all, the most promising in full.

    candidates: variants by name; progress: is told every name. thorough: every random effect is fitted, however little
    it promises, and each parameter's strength is that of the variant which frees it alone, since the strength of the
    best of several variants would be biased upwards. promising: names that are judged in full whatever the first look
    says.
    """
    start = start_of(on, chosen)
    looks = first_looks(start, candidates, progress)
    means = _best_variants(looks.means)
    unpromising, random = random_looks(start, looks.random, means, thorough)
    to_fit, looked_at = _split(means + unpromising, start.gain, promising)
    means_to_fit = [PricedVariant(j.name, j.terms[len(start.terms):], j.choice_cost) for j in to_fit]
    waiting = [*looks.unseen, *random, *means_to_fit]
    if thorough:
        waiting = [v for v in waiting if not _is_tried_alone(v)]
    fitted = map_on_two_cores(lambda v: cross_validated(on, v.name, v.terms, chosen, v.choice_cost), waiting)
    best = best_of_each([*fitted, *looked_at], len(start.terms))
    if thorough:
        best = {n: _one_by_one(j, [k for k in fitted if k.name == n]) for n, j in best.items()}
    return _with_evidence(on.data.study.scatter, best, start.gain)


def _best_variants(looked: Sequence[Candidate]) -> list[Candidate]:
    """The best of each candidate's variants of one length, best first."""
    best: dict[tuple[str, int], Candidate] = {}
    for j in sorted(looked, key=lambda j: -j.gain):
        best.setdefault((j.name, len(j.terms)), j)
    return list(best.values())


def _split(looked: Sequence[Candidate], gain: float, promising: Container[str],
           ) -> tuple[list[Candidate], list[Candidate]]:
    """Looks, the best of mean effects first, that a fit is worth, and the others.

    gain: nats of what is chosen, over which a look must gain to be among the FULL best; promising: names that need not.
    """
    worth = [j.name in promising or i < FULL and j.gain - gain > PROMISING * FIRST_GAIN for i, j in enumerate(looked)]
    pairs = list(zip(looked, worth, strict=True))
    return [j for j, fit in pairs if fit], [j for j, fit in pairs if not fit]


def best_of_each(judged: Sequence[Candidate], before: int) -> dict[str, Candidate]:
    """The best hypothesis of each candidate, on top of so many terms that were there before.

    One with a random part or a companion must earn it, LEAST_GAIN; where its companion alone gains as much, it is that
    which gains.
    """
    best: dict[str, Candidate] = {}
    for j in sorted(judged, key=lambda j: len(j.terms)):
        old = best.get(j.name)
        need = LEAST_GAIN if old is not None and len(j.terms) > len(old.terms) else 0.0
        if old is None or (j.full, j.gain) > (old.full, old.gain + need):
            best[j.name] = j
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
    alone = {int(np.argmin(j.variance)): j for j in variants if np.isfinite(j.variance).sum() == 1}
    if len(alone) < max(len(best.strength), 2):
        return best
    *others, own = best.terms
    return replace(best, terms=(*others, replace(own, free=own.signature.free)), apart=0.0,
                   strength=np.array([alone[i].strength[i] for i in range(len(alone))]),
                   covariance=np.diag([alone[i].variance[i] for i in range(len(alone))]))


def _with_evidence(scatter: Scatter | None, best: Mapping[str, Candidate], before: float) -> dict[str, Candidate]:
    """Every candidate with its evidence: what it gains over `before`, nats, and no more than its strength says.

    It is at most 0 nats where a parameter lies at a bound: there the effect stands in for another. scatter: of
    strengths in nominal flights; without one a strength says nothing.
    """
    out = {}
    for n, j in best.items():
        mine = [t for t in j.terms if t.name == n]
        own = strength_term(mine[-2:]) if mine[-1].companion else mine[-1]
        stretched = own.shows_in == MEAN and at_bound(own, j.strength).any()
        rarity = scatter.evidence(n, j.strength, j.covariance, j.apart) if scatter else np.inf
        out[n] = replace(j, evidence=min(j.gain - before, 0.0 if stretched else rarity))
    return out
