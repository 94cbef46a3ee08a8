"""One hypothesis judged: fitted on one half of the blocks and judged on the other.

Two halves of the flights (of the blocks, for a few flights) take turns.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airtouch.gap.evidence.clock import clock_gain
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import Fit, fit, judge
from airtouch.gap.evidence.problem import Part
from airtouch.gap.naming.screen import Screen
from airtouch.gap.naming.selection import Hypothesis, Judged
from airtouch.gap.signals.spectra import AIR, REST
from airtouch.gap.signatures.candidates import random_of, strength_term
from airtouch.gap.signatures.signature import CLOCK, MEAN
from airtouch.gap.signatures.term import Term

GROUP = 3  #: neighbouring blocks that stay on one side of the split: 5 s; chosen
#: nats of held-out data that an effect must add: chosen; a gain of 12 by chance has odds of e^-12 (host/docs/gap.md)
LEAST_GAIN = 12.0
FIRST_GAIN = 8.0  #: the same for the first effect, against a floor from nominal flights; chosen
PRICE = 0.9  #: nats, of each further parameter of an effect; chosen, near Akaike's 1 (1974)
STRETCHED = 0.999  #: of a parameter's bound, from which it is at it
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


def at_bound(term: Term, strength: np.ndarray) -> np.ndarray:
    """Which scaled parameters (k,) lie as far from neutral as they may: the model stretches to fit something else."""
    low, high = (term.among_all(b) for b in term.bounds())
    return (strength != 0.0) & ((strength <= STRETCHED * low) | (strength >= STRETCHED * high))


def price_of(terms: Sequence[Term]) -> float:
    """Held-out log likelihood that parameters beyond an effect's first must earn."""
    return PRICE * sum(len(t.free) - 1 for t in terms if t.kind != CLOCK)


def crossed(on: Trial, name: str, terms: Hypothesis, chosen: Judged | None, choice: float) -> Judged:
    """Fit on each half, judge on the other; choice: what the choice of this variant costs.

    Beside a random effect the commands' floor is less certain, so what is chosen already gains less than it did; the
    newcomer is not charged with that.
    """
    held = chosen.terms if chosen else ()
    joint = (*held, *terms)
    timed = [t for t in terms if t.kind == CLOCK]
    paid = choice + (chosen.choice if chosen else 0.0)
    beyond = chosen.beyond if chosen else 0.0
    wider = 0.0
    if chosen and chosen.fits and not random_of(held) and random_of(terms):
        wider = sum(gain_of(on, test, chosen.fits[train].terms) - gain_of(on, test, chosen.fits[train].terms, True)
                    for train, test in ROUND_TRIP)
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
        gain += beyond + wider - price_of(refined.terms if others else ()) - paid
    fitted = list(fits[0].terms) if fits else []
    for t in (t for t in joint if t.kind == CLOCK):
        on_clock, clock_nats = clock_gain(on.data, t)
        fitted.append(on_clock)
        gain += clock_nats if t in timed else 0.0
    strength, covariance, apart = strength_of(strength_term(terms), fitted, fits)
    return Judged(name, tuple(fitted), gain, tuple(fits), choice=paid, strength=strength, covariance=covariance,
                  apart=apart, beyond=beyond + wider)


def gain_of(on: Trial, half: int, terms: Sequence[Term], wide: bool = False) -> float:
    """Log likelihood that fitted effects add on a half, over no effect as sure of the commands' floor.

    wide: that floor is as uncertain as under random effects, though there are none.
    """
    return judge(on.data, on.parts[half], terms, wide) - on.base[wide or bool(random_of(terms))][half]


def strength_of(term: Term, fitted: Sequence[Term], fits: Sequence[Fit]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Scaled parameters (k,) of a term as fitted, the mean of both halves; covariance (k, k), 0 but for mean effects;

    half of what the halves differ by (k,). k: of all parameters that the effect may have free; those that this variant
    leaves alone are 0, and nobody knows how far they lie from it.
    """
    hypotheses = [fitted] if term.kind == CLOCK or not fits else [f.terms for f in fits]
    same = [next(t for t in terms if _kind_of(t) == _kind_of(term)) for terms in hypotheses]
    k = len(term.free)
    each = np.array([t.scaled(t.values)[:k] for t in same])
    strength = term.among_all(each.mean(axis=0))
    if term.kind != MEAN:
        return strength, np.zeros((len(strength), len(strength))), np.zeros(len(strength))
    covariance = np.zeros((k, k))
    for f, t in zip(fits, same, strict=True):
        place = sum(len(x.free) for x in f.terms[:f.terms.index(t)] if x.kind == MEAN)
        covariance += f.covariance[place:place + k, place:place + k] / len(fits) ** 2
    return strength, covariance_among_all(term, covariance), term.among_all(0.5 * (each[0] - each[-1]))


def covariance_among_all(term: Term, covariance: np.ndarray) -> np.ndarray:
    """Covariance of all parameters that an effect may have free, from that of a term's own; infinite for the others."""
    place = term.among_all(np.arange(len(term.free)), -1).astype(int)
    own = np.flatnonzero(place >= 0)
    out = np.diag(np.full(len(place), np.inf))
    out[np.ix_(own, own)] = covariance[np.ix_(place[own], place[own])]
    return out


def _kind_of(term: Term) -> tuple:
    """What tells a term from others of a hypothesis."""
    return term.name, term.kind, term.values.get("rotor")


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
