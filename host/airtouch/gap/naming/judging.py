"""Candidates judged: each is fitted on one half of the blocks and judged on the other.

Two halves of the flights (of the blocks, for a few flights) take turns. A first look at every candidate costs little;
the most promising are fitted in full.
"""

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from airtouch.gap.evidence.clock import clock_gain
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import Fit, fit, judge, left_over
from airtouch.gap.evidence.problem import Part
from airtouch.gap.loop.twin import COMMAND_ONLY
from airtouch.gap.naming.screen import Screen, first_order, random_look
from airtouch.gap.naming.selection import Hypothesis, Judged
from airtouch.gap.signals.spectra import AIR, REST
from airtouch.gap.signatures.candidates import CLOCK, COMPANIONS, MEAN, SPECTRUM, Term, telling, twins_of
from airtouch.gap.signatures.nominal_scatter import Scatter

GROUP = 3  #: neighbouring blocks that stay on one side of the split: 5 s
LEAST_GAIN = 12.0  #: held-out log likelihood that an effect must add
FIRST_GAIN = 8.0  #: the same for the first effect, against a floor from nominal flights
PRICE = 0.9  #: of each further parameter of an effect
STRETCHED = 0.999  #: of a parameter's bound, from which it is at it
HOPELESS = 0.5  #: gain below which an effect is not looked at any closer in this view
FULL = 5  #: candidates that are fitted in full, after a first look at all
ROUND_TRIP = ((0, 1), (1, 0))  #: the half that is fitted, the half that is judged


@dataclass(frozen=True)
class Trial:
    """What hypotheses are judged on: flights, their two halves, the log likelihood (2, 2) of no effect on each half, as

    sure of the commands' floor as without and with random effects, and what the first look has made so far.
    """

    data: Data
    parts: tuple[Part, Part]
    base: Sequence[Sequence[float]]
    screen: Screen


def trial_of(data: Data) -> Trial:
    """Flights made ready to be judged."""
    parts = halves(data)
    return Trial(data, parts, [[judge(data, p, (), wide) for p in parts] for wide in (False, True)], Screen(data))


def halves(data: Data) -> tuple[Part, Part]:
    """Two halves: by flight where there are four or more, else alternating groups of blocks."""
    first, second = [], []
    for i, f in enumerate(data.first):
        for regime in (AIR, REST):
            n = len(f[regime])
            if not n:
                continue
            if len(data.flights) >= 4:
                (first if i % 2 == 0 else second).append((i, regime, np.ones(n, bool)))
            else:
                even = (np.arange(n) // max(min(GROUP, n // 2), 1)) % 2 == 0
                first.append((i, regime, even))
                second.append((i, regime, ~even))
    return Part(tuple(first)), Part(tuple(second))


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
    twins = {n for t in held if not t.companion and (group := twins_of(t.name)) for n in group[0] if n != t.name}
    residuals, extra_power = _residuals(on, chosen)
    looked, sure, with_random = [], [], []
    for name, variants in candidates.items():
        progress(name)
        if name in twins:
            continue
        for terms in variants:
            if any((t.name, t.values.get("rotor")) in have for t in terms):
                continue
            choice = np.log(sum(len(v) == len(terms) for v in variants))  # among so many; else many would beat one
            if all(t.kind == MEAN and t.name not in COMMAND_ONLY for t in terms):
                gain, fitted, variances = first_order(on.screen, on.parts, residuals, extra_power, terms, held)
                gain += before - price_of(terms) - choice
                if gain < before + HOPELESS and _only_in_commands(on, terms):
                    sure.append(crossed(on, name, terms, chosen, choice))
                    continue
                own, k = terms[0], len(terms[0].free)
                each = np.array(fitted)[:, :k]
                looked.append(Judged(name, (*held, *terms), gain, full=False, choice=choice,
                                     strength=own.among_all(each.mean(axis=0)),
                                     variance=own.among_all(_of_mean(each, np.array(variances)[:, :k]), np.inf)))
            elif any(t.kind == SPECTRUM for t in terms):
                with_random.append((name, terms, choice))
            else:
                sure.append(crossed(on, name, terms, chosen, choice))
    looked = _best_variants(looked)
    tried = _with_random_parts(on, residuals, extra_power, chosen, with_random, looked, thorough)
    sure += [j for j in tried if j.full]
    looked += [j for j in tried if not j.full]
    worth = [j for i, j in enumerate(looked)
             if i < FULL and (j.gain - before > 0.5 * FIRST_GAIN) or j.name in promising]
    sure += [crossed(on, j.name, j.terms[len(held):], chosen, j.choice) for j in worth]
    best = _best_of_each([*sure, *(j for j in looked if j not in worth)], len(held))
    if thorough:
        best = {n: _one_by_one(j, [k for k in sure if k.name == n]) for n, j in best.items()}
    return _with_evidence(on.data.study.scatter, best, before)


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
                   variance=np.array([alone[i].variance[i] for i in range(len(alone))]))


def _with_random_parts(on: Trial, residuals: Sequence[np.ndarray], extra_power: Sequence[np.ndarray],
                       chosen: Judged | None, hypotheses: Sequence[tuple[str, Hypothesis, float]],
                       means: Sequence[Judged], thorough: bool) -> list[Judged]:
    """Hypotheses with a random effect: the variant of each that a first look finds best is judged in full.

    hypotheses: name, terms, and what the choice of the variant costs. means: looks at mean effects, best first; the
    random part of one of these goes with its best variant.
    """
    before, held = (chosen.gain, chosen.terms) if chosen else (0.0, ())
    mean = {j.name: j for j in reversed(means) if len(j.terms) == len(held) + 1}
    looks: dict[str, list[tuple[float, np.ndarray, Hypothesis, float]]] = {}
    for name, terms, choice in hypotheses:
        if name in mean and not _same(terms[0], mean[name].terms[-1]):
            continue
        if len(terms) == 1 or terms[0].kind == MEAN:
            random = next(t for t in terms if t.kind == SPECTRUM)
            gain, strength = random_look(on.screen, on.parts, residuals, extra_power, random)
            looks.setdefault(name, []).append((gain - choice, strength, terms, choice))
    out = []
    for name, tried in looks.items():
        gain, strength, terms, choice = max(tried, key=lambda t: t[0])
        promising = gain > HOPELESS or name in mean and mean[name].gain - before > HOPELESS
        if not (promising or thorough):
            if name not in mean:  # else the look at its mean part says what there is
                out.append(Judged(name, (*held, *terms), before + min(gain, 0.0), full=False, choice=choice,
                                  strength=telling(terms).among_all(strength)))
            continue
        longer = [(t, c) for n, t, c in hypotheses if n == name and len(t) > len(terms) and _same(t[0], terms[0])]
        out += [crossed(on, name, t, chosen, c) for t, c in ((terms, choice), *longer)]
    return out


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
    """Every candidate with its evidence: what it gains, and no more than its strength alone says.

    None where the strength is the largest that can be: there the effect stands in for another.
    """
    out = {}
    for n, j in best.items():
        mine = [t for t in j.terms if t.name == n]
        own = telling(mine[-2:]) if mine[-1].companion else mine[-1]
        stretched = own.kind == MEAN and at_bound(own, j.strength).any()
        error = np.sqrt(j.variance) if len(j.variance) else 0.0
        news = scatter.evidence(n, j.strength, error) if scatter else np.inf
        out[n] = replace(j, evidence=min(j.gain - before, 0.0 if stretched else news))
    return out


def at_bound(term: Term, strength: np.ndarray) -> np.ndarray:
    """Which scaled parameters (k,) lie as far from neutral as they may: the model stretches to fit something else."""
    low, high = (term.among_all(b) for b in term.bounds())
    return (strength != 0.0) & ((strength <= STRETCHED * low) | (strength >= STRETCHED * high))


def price_of(terms: Sequence[Term]) -> float:
    """Held-out log likelihood that parameters beyond an effect's first must earn."""
    return PRICE * sum(len(t.free) - 1 for t in terms if t.kind != CLOCK)


def _best_variants(looked: Sequence[Judged]) -> list[Judged]:
    """The best of each candidate's variants of one length, best first."""
    best: dict[tuple[str, int], Judged] = {}
    for j in sorted(looked, key=lambda j: -j.gain):
        best.setdefault((j.name, len(j.terms)), j)
    return list(best.values())


def crossed(on: Trial, name: str, terms: Hypothesis, chosen: Judged | None, choice: float) -> Judged:
    """Fit on each half, judge on the other; choice: what the choice of this variant costs."""
    held = chosen.terms if chosen else ()
    joint = (*held, *terms)
    timed = [t for t in terms if t.kind == CLOCK]
    paid = choice + (chosen.choice if chosen else 0.0)
    gain, fits = 0.0, []
    if chosen and not [t for t in terms if t.kind != CLOCK]:
        gain, fits = chosen.gain, list(chosen.fits)
    else:
        others = [t for t in joint if t.kind != CLOCK]
        gain += sum(clock_gain(on.data, t)[1] for t in held if t.kind == CLOCK)
        for train, test in ROUND_TRIP:
            part = on.parts[train]
            refined = _refined(on.data, part, fit(on.data, part, others, _start(chosen, others, train)))
            gain += gain_of(on, test, refined.terms) if others else 0.0
            fits.append(refined)
        gain -= price_of(refined.terms if others else ()) + paid
    fitted = list(fits[0].terms) if fits else []
    for t in (t for t in joint if t.kind == CLOCK):
        on_clock, clock_nats = clock_gain(on.data, t)
        fitted.append(on_clock)
        gain += clock_nats if t in timed else 0.0
    strength, variance = strength_of(telling(terms), fitted, fits)
    return Judged(name, tuple(fitted), gain, tuple(fits), choice=paid, strength=strength, variance=variance)


def gain_of(on: Trial, half: int, terms: Sequence[Term]) -> float:
    """Log likelihood that fitted effects add on a half, over no effect as sure of the commands' floor."""
    return judge(on.data, on.parts[half], terms) - on.base[any(t.kind == SPECTRUM for t in terms)][half]


def strength_of(term: Term, fitted: Sequence[Term], fits: Sequence[Fit]) -> tuple[np.ndarray, np.ndarray]:
    """Scaled parameters (k,) of a term as fitted, the mean of both halves, and variances (k,), 0 but for mean effects.

    k: of all parameters that the effect may have free; those that this variant leaves alone are 0, and nobody knows
    how far they lie from it.
    """
    hypotheses = [fitted] if term.kind == CLOCK or not fits else [f.terms for f in fits]
    same = [next(t for t in terms if _kind_of(t) == _kind_of(term)) for terms in hypotheses]
    k = len(term.free)
    each = np.array([t.scaled(t.values)[:k] for t in same])
    strength = term.among_all(each.mean(axis=0))
    if term.kind != MEAN:
        return strength, np.zeros(len(strength))
    variances = []
    for f, t in zip(fits, same, strict=True):
        place = sum(len(x.free) for x in f.terms[:f.terms.index(t)] if x.kind == MEAN)
        variances.append(np.diag(f.covariance)[place:place + k])
    return strength, term.among_all(_of_mean(each, np.array(variances)), np.inf)


def _kind_of(term: Term) -> tuple:
    """What tells a term from others of a hypothesis."""
    return term.name, term.kind, term.values.get("rotor")


def _of_mean(values: np.ndarray, variances: np.ndarray) -> np.ndarray:
    """Variance (k,) of the mean of independent values (n, k), no less than what they differ by says.

    Where the likelihood has two peaks, its curvature at one of them knows nothing of the other.
    """
    apart = values.var(axis=0, ddof=1) / len(values) if len(values) > 1 else 0.0
    return np.maximum(variances.sum(axis=0) / len(variances) ** 2, apart)


def _refined(data: Data, part: Part, found: Fit) -> Fit:
    """A fit with the parameters free too that only a fit close to the truth can find."""
    terms = [t.refined() for t in found.terms]
    if all(a.free == b.free for a, b in zip(terms, found.terms, strict=True)):
        return found
    return fit(data, part, terms, np.concatenate([t.scaled(t.values) for t in terms if t.kind == MEAN]))


def _start(chosen: Judged | None, terms: Sequence[Term], train: int) -> np.ndarray | None:
    """The parameters found before, NaN for those of the new effects; None where nothing was found."""
    if chosen is None or not chosen.fits:
        return None
    known = chosen.fits[train].scaled
    size = sum(len(t.free) for t in terms if t.kind == MEAN)
    return np.concatenate([known, np.full(size - len(known), np.nan)])
