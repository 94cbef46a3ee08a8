"""One round of the selection: every candidate beside the effects that are chosen already.

A first look at every candidate costs little; the most promising are fitted in full.
"""

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import replace

import numpy as np

from airtouch.gap.evidence.fit import left_over
from airtouch.gap.loop.closed_loop import COMMAND_ONLY
from airtouch.gap.naming.judging import FIRST_GAIN, LEAST_GAIN, Trial, at_bound, covariance_among_all, crossed, price_of
from airtouch.gap.naming.screen import first_order, random_look
from airtouch.gap.naming.selection import Hypothesis, Judged
from airtouch.gap.second_process import shared
from airtouch.gap.signatures.alike import names_alike
from airtouch.gap.signatures.candidates import random_of, strength_term
from airtouch.gap.signatures.nominal_scatter import Scatter
from airtouch.gap.signatures.signature import COMPANIONS, MEAN
from airtouch.gap.signatures.term import Term

HOPELESS = 0.5  #: nats, gain below which an effect is not looked at any closer in this view; chosen
FULL = 5  #: candidates that are fitted in full, after a first look at all; chosen for time
Waiting = tuple[str, Hypothesis, float]  #: name, terms, and what the choice of the variant costs


def round_of(on: Trial, candidates: Mapping[str, Sequence[Hypothesis]], chosen: Judged | None,
             progress: Callable[[str], None] = lambda _: None, thorough: bool = False,
             promising: Container[str] = ()) -> dict[str, Judged]:
    """Every candidate on top of what is chosen: a first look at all, the most promising in full.

    thorough: random effects in full, however little they promise, and the strength of each parameter that is also
    tried alone from that trial: the best of several would seem stronger than each of them is. promising: names that
    are judged in full whatever the first look says.
    """
    before = chosen.gain if chosen else 0.0
    held = chosen.terms if chosen else ()
    have = {(t.name, t.values.get("rotor")) for t in held if not t.companion}
    alike = {n for t in held if not t.companion and (group := names_alike(t.name)) for n in group[0] if n != t.name}
    residuals, extra_power = _residuals(on, chosen)
    looked, waiting, with_random = [], [], []
    for name, variants in candidates.items():
        progress(name)
        if name in alike:
            continue
        for terms in variants:
            if any((t.name, t.values.get("rotor")) in have for t in terms):
                continue
            choice = np.log(sum(len(v) == len(terms) for v in variants))  # among so many; else many would beat one
            if all(t.kind == MEAN and t.name not in COMMAND_ONLY for t in terms):
                gain, fitted, variances = first_order(on.screen, on.parts, residuals, extra_power, terms, held)
                gain += before - price_of(terms) - choice
                if gain < before + HOPELESS and _only_in_commands(on, terms):
                    waiting.append((name, terms, choice))
                    continue
                own, k = terms[0], len(terms[0].free)
                each = np.array(fitted)[:, :k]
                looked.append(Judged(name, (*held, *terms), gain, full=False, choice=choice,
                                     strength=own.among_all(each.mean(axis=0)),
                                     covariance=covariance_among_all(own, np.diag(_of_mean(each, variances, k)))))
            elif random_of(terms):
                with_random.append((name, terms, choice))
            else:
                waiting.append((name, terms, choice))
    looked = _best_variants(looked)
    unpromising, promising_random = _random_parts(on, residuals, extra_power, chosen, with_random, looked, thorough)
    looked += unpromising
    worth = [j for i, j in enumerate(looked)
             if i < FULL and (j.gain - before > 0.5 * FIRST_GAIN) or j.name in promising]
    waiting += promising_random + [(j.name, j.terms[len(held):], j.choice) for j in worth]
    sure = shared(lambda one: crossed(on, one[0], one[1], chosen, one[2]), waiting)
    best = _best_of_each([*sure, *(j for j in looked if j not in worth)], len(held))
    if thorough:
        best = {n: _one_by_one(j, [k for k in sure if k.name == n]) for n, j in best.items()}
    return _with_evidence(on.data.study.scatter, best, before)


def _of_mean(each: np.ndarray, variances: Sequence[np.ndarray], k: int) -> np.ndarray:
    """Variance (k,) of the mean of two values (2, k), of variances (2, k or more), and no less than they differ by."""
    return np.maximum(np.sum(variances, axis=0)[:k] / 4.0, np.square(0.5 * np.ptp(each, axis=0)))


def _residuals(on: Trial, chosen: Judged | None) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """What a hypothesis, fitted on the other half, leaves of each half, flattened, and the power that it adds."""
    residuals, extra_power = [], []
    for k, part in enumerate(on.parts):
        problem, values, power = left_over(on.data, part, chosen.fits[1 - k].terms if chosen and chosen.fits else ())
        residuals.append(values)
        extra_power.append(power - problem.power)
    return residuals, extra_power


def _best_of_each(judged: Sequence[Judged], held: int) -> dict[str, Judged]:
    """The best hypothesis of each candidate, on top of so many terms that were there before.

    One with a random part or a companion must earn it; where its companion alone gains as much, it is that which gains.
    """
    best: dict[str, Judged] = {}
    for j in judged:
        old = best.get(j.name)
        need = LEAST_GAIN if old is not None and len(j.terms) > len(old.terms) else 0.0
        if old is None or (j.full, j.gain) > (old.full, old.gain + need):
            best[j.name] = j
    for name, other in COMPANIONS.items():
        both, alone = best.get(name), best.get(other)
        if both and alone and len(both.terms) > held + 1 and both.gain < alone.gain + LEAST_GAIN:
            best[name] = replace(both, gain=min(both.gain, alone.gain - LEAST_GAIN))
    return best


def _one_by_one(best: Judged, variants: Sequence[Judged]) -> Judged:
    """A candidate whose parameters (k,) were all tried alone, with the strength that each has there."""
    alone = {int(np.argmin(j.variance)): j for j in variants if np.isfinite(j.variance).sum() == 1}
    together = next((j for j in variants if np.isfinite(j.variance).all()), best)
    if len(alone) < max(len(best.strength), 2):
        return best
    return replace(together, strength=np.array([alone[i].strength[i] for i in range(len(alone))]),
                   covariance=np.diag([alone[i].variance[i] for i in range(len(alone))]), apart=0.0)


def _random_parts(on: Trial, residuals: Sequence[np.ndarray], extra_power: Sequence[np.ndarray],
                  chosen: Judged | None, hypotheses: Sequence[Waiting], means: Sequence[Judged], thorough: bool,
                  ) -> tuple[list[Judged], list[Waiting]]:
    """Hypotheses with a random effect: those that promise little, and of the others the variant that looks best.

    means: looks at mean effects, best first; the random part of one of these goes with its best variant.
    """
    before, held = (chosen.gain, chosen.terms) if chosen else (0.0, ())
    mean = {j.name: j for j in reversed(means) if len(j.terms) == len(held) + 1}
    looks: dict[str, list[tuple[float, np.ndarray, Hypothesis, float]]] = {}
    for name, terms, choice in hypotheses:
        if name in mean and not _same(terms[0], mean[name].terms[-1]):
            continue
        if len(terms) == 1 or terms[0].kind == MEAN:
            random = random_of(terms)[0]
            gain, strength = random_look(on.screen, on.parts, residuals, extra_power, random)
            looks.setdefault(name, []).append((gain - choice, strength, terms, choice))
    out, waiting = [], []
    for name, tried in looks.items():
        gain, strength, terms, choice = max(tried, key=lambda t: t[0])
        promising = gain > HOPELESS or name in mean and mean[name].gain - before > HOPELESS
        if not (promising or thorough):
            if name not in mean:  # else the look at its mean part says what there is
                out.append(Judged(name, (*held, *terms), before + min(gain, 0.0), full=False, choice=choice,
                                  strength=strength_term(terms).among_all(strength)))
            continue
        longer = [(t, c) for n, t, c in hypotheses if n == name and len(t) > len(terms) and _same(t[0], terms[0])]
        waiting += [(name, t, c) for t, c in ((terms, choice), *longer)]
    return out, waiting


def _only_in_commands(on: Trial, terms: Hypothesis) -> bool:
    """Whether effects change what the loop commands, and nothing of what the logged commands lead to expect."""
    law = on.data.study.controller
    moved = [t.active(np.ones(len(t.free))) for t in terms]
    return law is not None and not any(on.screen.shows(t) for t in terms) and not np.allclose(law.ratio(moved), 1.0)


def _same(one: Term, other: Term) -> bool:
    """Whether two terms are the same variant of an effect."""
    fixed = [{k: v for k, v in t.values.items() if k not in t.free} for t in (one, other)]
    return one.name == other.name and one.free == other.free and fixed[0] == fixed[1]


def _with_evidence(scatter: Scatter | None, best: Mapping[str, Judged], before: float) -> dict[str, Judged]:
    """Every candidate with its evidence: what it gains, and no more than its strength says.

    None where the strength is the largest that can be: there the effect stands in for another.
    """
    out = {}
    for n, j in best.items():
        mine = [t for t in j.terms if t.name == n]
        own = strength_term(mine[-2:]) if mine[-1].companion else mine[-1]
        stretched = own.kind == MEAN and at_bound(own, j.strength).any()
        news = scatter.evidence(n, j.strength, j.covariance, j.apart) if scatter else np.inf
        out[n] = replace(j, evidence=min(j.gain - before, 0.0 if stretched else news))
    return out


def _best_variants(looked: Sequence[Judged]) -> list[Judged]:
    """The best of each candidate's variants of one length, best first."""
    best: dict[tuple[str, int], Judged] = {}
    for j in sorted(looked, key=lambda j: -j.gain):
        best.setdefault((j.name, len(j.terms)), j)
    return list(best.values())
