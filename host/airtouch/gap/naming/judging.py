"""One hypothesis judged: fitted on one half of the flights and judged on the other, and the other way round.

Of a few flights each half has some blocks of every flight. A hypothesis gains, in nats over no effect,

    gain = gain_of(half 0) + gain_of(half 1)    held-out log likelihood of the spectra, each half by the other's fit
           + clock_gains                        log likelihood of the logged times, by effects that show there alone
           + sensing_gain                       log likelihood of another echo of noise, by effects that delay it
           - price_of                           PRICE of each free parameter of a term beyond its first; a random part
                                                or a companion pays LONGER_GAIN instead (`rounds`)
           - choice_cost                        log n for the choice among the n variants of each effect (`Charges`)
           + uncertain_floor_loss               nats that effects lose beside the first random one, only because the
                                                commands' floor counts as less certain there (`Charges`)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.clock import clock_gains, measured_clock_term
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import FittedTerms, fit, mean_parameters
from airtouch.gap.evidence.judge import cell_gains, judge
from airtouch.gap.evidence.problem import TWO_FOLDS, BlockSet
from airtouch.gap.evidence.sensing import gain_outside
from airtouch.gap.naming.policy import PRICE, NamingPolicy, policy_of
from airtouch.gap.naming.records import Charges, Hypothesis, Strength
from airtouch.gap.signals.spectra import AIR, REST
from airtouch.gap.signatures.candidates import mean_of, random_of, strength_term
from airtouch.gap.signatures.signature import CLOCK, MEAN
from airtouch.gap.signatures.term import Term, Terms, mean_slices

GROUP = 3  #: neighbouring blocks that stay in one half, in the air 5 s together; chosen
HALVED_BY_FLIGHT = 4  #: flights from which on the halves are made of whole flights; chosen
NEAR_BOUND = 0.999  #: share of a bound from which a parameter is at that bound; chosen: fits end just short of one


class PricedVariant(NamedTuple):
    """A variant of an effect, and the nats that the choice among the effect's variants costs."""

    name: str
    terms: Terms
    choice_cost: float


@dataclass(frozen=True)
class Trial:
    """The flights that hypotheses are judged on, and the likelihood of none.

    halves: the blocks of the flights, in two; policy: what they must show; null_log_likelihood: of no effect on each
    half, with the commands' floor as certain as without random effects; null_log_likelihood_uncertain_floor: the same,
    with that floor as uncertain as with them.
    """

    data: Data
    halves: tuple[BlockSet, BlockSet]
    policy: NamingPolicy
    null_log_likelihood: Sequence[float]
    null_log_likelihood_uncertain_floor: Sequence[float]


def trial_of(data: Data) -> Trial:
    """The trial of some flights: halved, with the policy of their study."""
    of_data = halves(data)
    certain_floor, uncertain_floor = ([judge(data, half, (), uncertain) for half in of_data]
                                      for uncertain in (False, True))
    return Trial(data, of_data, policy_of(data.study, data.seconds), certain_floor, uncertain_floor)


def halves(data: Data) -> tuple[BlockSet, BlockSet]:
    """Two halves: by flight where HALVED_BY_FLIGHT or more have a block in the air, else alternating groups of blocks.

    By flight, those with a block in the air are taken in turns, so that both halves have some.
    """
    flown = [i for i, f in enumerate(data.block_starts) if len(f[AIR])]
    turn = {flight: k % 2 for k, flight in enumerate(flown)}
    by_flight = len(flown) >= HALVED_BY_FLIGHT
    pieces: tuple[list, list] = ([], [])
    counts = [(i, state, len(f[state])) for i, f in enumerate(data.block_starts) for state in (AIR, REST)]
    for i, state, n in counts:
        if n and by_flight:
            pieces[turn.get(i, 0)].append((i, state, np.ones(n, bool)))
        elif n:
            even = (np.arange(n) // max(min(GROUP, n // 2), 1)) % 2 == 0
            pieces[0].append((i, state, even))
            pieces[1].append((i, state, ~even))
    return BlockSet(tuple(pieces[0])), BlockSet(tuple(pieces[1]))


def at_bound(term: Term, strength: np.ndarray) -> np.ndarray:
    """Whether each scaled parameter (k,) lies at its bound, as where the model stretches to fit another effect."""
    low, high = (term.among_all(b) for b in term.bounds())
    return (strength != 0.0) & ((strength <= NEAR_BOUND * low) | (strength >= NEAR_BOUND * high))


def cross_validated(trial: Trial, variant: PricedVariant, base: Hypothesis | None, brief: bool = False,
                    near: Hypothesis | None = None) -> Hypothesis:
    """The hypothesis that adds a variant to those effects of a base, fitted on each half and judged on the other.

    base: None for no effect; brief: the fits are cut short, to see whether whole ones promise anything; near: an
    earlier hypothesis with the variant, at whose values of it the fits begin.
    """
    terms, before = variant.terms, base.terms if base else ()
    charges = _charges(trial, variant, base)
    if base and all(t.shows_in == CLOCK for t in terms):  # nothing changes in the spectra
        gain, fits = base.gain - variant.choice_cost + clock_gains(trial.data, terms), base.fits
    else:
        spectral = [t for t in (*before, *terms) if t.shows_in != CLOCK]
        fits = tuple(_fit_on(trial, half, spectral, _start(base, spectral, half, near), brief) for half in (0, 1))
        gain = _charged_gain(trial, fits, charges, gain_outside(trial.data, (*before, *terms)))
    of_clock = [measured_clock_term(trial.data, t).term for t in (*before, *terms) if t.shows_in == CLOCK]
    # the halves free the same parameters and differ in their values; a hypothesis has those of the first
    fitted = (*(fits[0].terms if fits else ()), *of_clock)
    strength = strength_of(strength_term(terms), fitted, fits)
    return Hypothesis(variant.name, fitted, gain, fits, not brief, charges, strength)


def _charges(trial: Trial, variant: PricedVariant, base: Hypothesis | None) -> Charges:
    """The charges of a base and a variant.

    Beside the first random effect the commands' floor is less certain, so that the effects before it gain less. The
    random effect is not charged with that (`Charges.uncertain_floor_loss`).
    """
    before = base.charges if base else Charges()
    if base is None or not base.fits or random_of(base.terms) or not random_of(variant.terms):
        return before.with_effect(variant.choice_cost)
    return before.with_effect(variant.choice_cost, uncertain_floor_loss(trial, base.fits))


def _charged_gain(trial: Trial, fits: Sequence[FittedTerms], charges: Charges, outside: float) -> float:
    """Nats that effects gain in the spectra after their charges, and outside them.

    fits: to each half; charges: of all effects; outside: nats of the logged times and of the echo.
    """
    held_out = sum((gain_of(trial, test, fits[train].terms) for train, test in TWO_FOLDS), outside)
    return held_out + (charges.uncertain_floor_loss - price_of(fits[0].terms) - charges.choice_cost)


def _fit_on(trial: Trial, half: int, terms: Sequence[Term], start: np.ndarray | None, brief: bool) -> FittedTerms:
    """Effects fitted on a half, from scaled parameters `start` on.

    The fit is cached: an effect of the clock beside the base changes nothing of it, nor does a second search among
    fewer effects.
    """
    blocks = trial.halves[half]
    key = half, brief, tuple(t.key for t in terms), None if start is None else start.tobytes()
    return trial.data.workspace.cached(
        "fit", key, lambda: _refine(trial.data, blocks, fit(trial.data, blocks, terms, start, brief=brief)))


def price_of(terms: Sequence[Term]) -> float:
    """Nats that free parameters of a term beyond its first must gain; one that shows in the times alone pays none."""
    return PRICE * sum(len(t.free) - 1 for t in terms if t.shows_in != CLOCK)


def uncertain_floor_loss(trial: Trial, fits: Sequence[FittedTerms]) -> float:
    """Held-out nats that effects, fitted on each half, lose where the commands' floor is as beside a random effect."""
    return sum(gain_of(trial, test, fits[train].terms) - gain_of(trial, test, fits[train].terms, uncertain_floor=True)
               for train, test in TWO_FOLDS)


def gain_of(trial: Trial, half: int, terms: Sequence[Term], uncertain_floor: bool = False) -> float:
    """Nats that fitted effects add on a half, over no effect with a commands' floor as certain.

    uncertain_floor: that floor is as uncertain as under random effects, though there are none.
    """
    uncertain = uncertain_floor or random_of(terms)
    null = trial.null_log_likelihood_uncertain_floor if uncertain else trial.null_log_likelihood
    return judge(trial.data, trial.halves[half], terms, uncertain_floor) - null[half]


def held_out_cell_gains(trial: Trial, hypothesis: Hypothesis) -> np.ndarray:
    """Nats (CELLS,) that a fitted hypothesis gains over none in each cell, fitted on one half, judged on the other."""
    return np.sum([cell_gains(trial.data, trial.halves[test], hypothesis.fits[train].terms)
                   for train, test in TWO_FOLDS], axis=0)


def strength_of(term: Term, fitted: Sequence[Term], fits: Sequence[FittedTerms]) -> Strength:
    """The strength of one term of a hypothesis.

    fitted: the terms of the hypothesis, with their values; fits: those of them that show in the spectra, to each half.
    """
    hypotheses = [fitted] if term.shows_in == CLOCK or not fits else [f.terms for f in fits]
    sought = term.slot, term.shows_in
    in_each = [next(t for t in terms if (t.slot, t.shows_in) == sought) for terms in hypotheses]
    k = len(term.free)
    scaled = np.array([t.scaled(t.values)[:k] for t in in_each])
    mean = term.among_all(scaled.mean(axis=0))
    if term.shows_in != MEAN:
        return Strength(mean, np.zeros((len(mean), len(mean))), np.zeros(len(mean)))
    covariance = np.zeros((k, k))
    for fit_of_half, own in zip(fits, in_each, strict=True):
        first = fit_of_half.slice_of(own).start
        covariance += fit_of_half.covariance[first:first + k, first:first + k] / len(fits) ** 2
    return Strength(mean, covariance_among_all(term, covariance), term.among_all(0.5 * (scaled[0] - scaled[-1])))


def covariance_among_all(term: Term, covariance: np.ndarray) -> np.ndarray:
    """Covariance (n, n) of all parameters that an effect may have free, from that of a term's own (k, k).

    It is infinite for the others.
    """
    index = term.among_all(np.arange(len(term.free)), -1).astype(int)
    own = np.flatnonzero(index >= 0)
    out = np.diag(np.full(len(index), np.inf))
    out[np.ix_(own, own)] = covariance[np.ix_(index[own], index[own])]
    return out


def _refine(data: Data, blocks: BlockSet, fitted: FittedTerms) -> FittedTerms:
    """A fit with those parameters free as well that only a fit close to the truth can find (`Term.refined`)."""
    terms = [t.refined() for t in fitted.terms]
    if all(a.free == b.free for a, b in zip(terms, fitted.terms, strict=True)):
        return fitted
    return fit(data, blocks, terms, mean_parameters(terms))


def _start(base: Hypothesis | None, terms: Sequence[Term], half: int, near: Hypothesis | None) -> np.ndarray | None:
    """Scaled parameters (k,) of mean effects as fitted to a half before, NaN for the new ones; None without a fit.

    near: where it has the new ones, free in the same parameters, these begin as fitted there.
    """
    of_base, of_near = (h.fits[half] if h is not None and h.fits else None for h in (base, near))
    if of_base is None and of_near is None:
        return None
    known = of_base.scaled if of_base is not None else np.zeros(0)
    out = np.concatenate([known, np.full(sum(len(t.free) for t in mean_of(terms)) - len(known), np.nan)])
    for term, own in mean_slices(terms):
        same = [t for t in (of_near.terms if of_near else ()) if (t.slot, t.free) == (term.slot, term.free)]
        if own.start >= len(known) and of_near is not None and same:
            out[own] = of_near.scaled[of_near.slice_of(same[0])]
    return out
