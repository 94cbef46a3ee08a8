"""Screening: every variant of every candidate beside a base, at a fraction of what its fit would cost."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.fit import PRIOR_STD
from airtouch.gap.evidence.judge import JudgedBlocks, judged_blocks
from airtouch.gap.evidence.problem import problem_of
from airtouch.gap.naming.judging import PricedVariant, Trial, covariance_among_all, price_of
from airtouch.gap.naming.policy import ABOUT_AS_GOOD, HOPELESS
from airtouch.gap.naming.records import Charges, Hypothesis, Strength
from airtouch.gap.naming.screening.first_order import judge_means, judge_random, shows
from airtouch.gap.second_process import map_on_two_cores
from airtouch.gap.signatures.alike import interchangeable
from airtouch.gap.signatures.candidates import random_of, strength_term
from airtouch.gap.signatures.signature import MEAN
from airtouch.gap.signatures.term import Term, Terms


class ScreenedRandom(NamedTuple):
    """Nats that a variant with a random effect gains, its choice paid, and the scaled strength (k,) of that effect."""

    gain: float
    strength: np.ndarray
    variant: PricedVariant


@dataclass(frozen=True)
class RoundStart:
    """What a round begins from: its base, None for no effect, and each half as judged under the fit to the other."""

    trial: Trial
    base: Hypothesis | None
    halves: Sequence[JudgedBlocks]

    @property
    def gain(self) -> float:
        """Held-out nats of the base over no effect."""
        return self.base.gain if self.base else 0.0

    @property
    def charges(self) -> Charges:
        """The charges of the base."""
        return self.base.charges if self.base else Charges()

    @property
    def terms(self) -> Terms:
        """The terms of the base."""
        return self.base.terms if self.base else ()

    @property
    def sees_edges(self) -> bool:
        """Whether a response at an edge is judged."""
        return any(problem_of(self.trial.data, half).flat.commands.edges for half in self.trial.halves)


@dataclass
class Screened:
    """Variants by how they are screened.

    means: hypotheses of mean effects, judged to first order; random: variants with a random effect, for
    `screen_random`; fit_only: those that only a fit can judge.
    """

    means: list[Hypothesis] = field(default_factory=list)
    random: list[PricedVariant] = field(default_factory=list)
    fit_only: list[PricedVariant] = field(default_factory=list)


def start_of(trial: Trial, base: Hypothesis | None) -> RoundStart:
    """What a round begins from, each half judged under the fit to the other half."""
    fitted = [f.terms for f in base.fits] if base and base.fits else [(), ()]
    halves = [judged_blocks(trial.data, blocks, fitted[1 - half]) for half, blocks in enumerate(trial.halves)]
    return RoundStart(trial, base, halves)


def screen_variants(start: RoundStart, candidates: Mapping[str, Sequence[Terms]],
                    progress: Callable[[str], None]) -> Screened:
    """Every variant that may be added, those of mean effects judged to first order.

    candidates: variants by name; progress: called with every name.
    """
    screened, means = Screened(), []
    for name, variants in candidates.items():
        progress(name)
        for variant in addable(name, variants, start.terms):
            (screened.random if random_of(variant.terms) else means).append(variant)
    for variant, judged in zip(means, map_on_two_cores(partial(_screened_means, start), means), strict=True):
        if judged is None:
            screened.fit_only.append(variant)
        else:
            screened.means.append(judged)
    return screened


def addable(name: str, variants: Sequence[Terms], base: Terms) -> list[PricedVariant]:
    """The variants of an effect that may stand beside the terms of a base.

    None may where the base has another name for the same thing, and a variant may not of which the base has a term
    (the same effect of another rotor is another term). Each costs log n nats for the choice among the n variants with
    as many terms: else many variants would gain more than one by chance.
    """
    without_companions = [t for t in base if not t.companion]
    if any(t.name != name and interchangeable(name, t.name) for t in without_companions):
        return []
    identities = {t.identity for t in without_companions}
    count_of_length = Counter(len(terms) for terms in variants)
    return [PricedVariant(name, terms, np.log(count_of_length[len(terms)])) for terms in variants
            if identities.isdisjoint(t.identity for t in terms)]


def _screened_means(start: RoundStart, variant: PricedVariant) -> Hypothesis | None:
    """A variant of mean effects judged to first order; None where only the commands show them, which a fit judges."""
    if all(t.signature.edges_only for t in variant.terms) and not start.sees_edges:
        return _without_a_trace(start, variant)
    if any(t.shows_in != MEAN or t.signature.commands_only for t in variant.terms):
        return None
    judged = _judged_to_first_order(start, variant)
    hopeless = judged.gain < start.gain + HOPELESS
    return None if hopeless and _only_in_commands(start.trial, variant.terms) else judged


def _without_a_trace(start: RoundStart, variant: PricedVariant) -> Hypothesis:
    """The hypothesis that adds effects of which the flights show nothing: it loses what it costs.

    Its strength has the variance of a mean of two halves.
    """
    k = len(strength_term(variant.terms).signature.free)
    return Hypothesis(variant.name, (*start.terms, *variant.terms),
                      start.gain - price_of(variant.terms) - variant.choice_cost, full=False,
                      charges=start.charges.with_effect(variant.choice_cost),
                      strength=Strength(np.zeros(k), 0.5 * PRIOR_STD ** 2 * np.eye(k), np.zeros(k)))


def _judged_to_first_order(start: RoundStart, variant: PricedVariant) -> Hypothesis:
    """The hypothesis that adds mean effects, judged to first order, with the strength of the first of them."""
    terms, own, k = variant.terms, variant.terms[0], len(variant.terms[0].free)
    judged = judge_means(start.trial.data, start.halves, terms, start.terms)
    gain = judged.gain + (start.gain - price_of(terms) - variant.choice_cost)
    of_halves = np.array(judged.estimates)[:, :k]
    strength = Strength(own.among_all(of_halves.mean(axis=0)),
                        covariance_among_all(own, np.diag(_variance_of_mean(of_halves, judged.variances, k))))
    return Hypothesis(variant.name, (*start.terms, *terms), gain, full=False,
                     charges=start.charges.with_effect(variant.choice_cost), strength=strength)


def _variance_of_mean(values: np.ndarray, variances: Sequence[np.ndarray], k: int) -> np.ndarray:
    """Variance (k,) of the mean of two values, and no less than half their difference squared.

    values (2, k); variances (2, k or more): theirs, of which the first k count.
    """
    return np.maximum(np.sum(variances, axis=0)[:k] / 4.0, np.square(0.5 * np.ptp(values, axis=0)))


def _only_in_commands(trial: Trial, terms: Terms) -> bool:
    """Whether effects change what the loop commands, and nothing of what the logged commands lead to expect."""
    loop = trial.data.study.loop
    one_step_off = [t.active(np.ones(len(t.free))) for t in terms]
    return loop is not None and not any(shows(trial.data, t) for t in terms) \
        and not np.allclose(loop.ratio(one_step_off), 1.0)


def screen_random(start: RoundStart, variants: Sequence[PricedVariant], means: Sequence[Hypothesis], every_random: bool,
                  ) -> tuple[list[Hypothesis], list[PricedVariant]]:
    """Variants with a random term: of candidates that promise little as hypotheses, of others those to be fitted.

    A random part is screened beside the base alone. Each mean term within ABOUT_AS_GOOD is then fitted with it; the
    best alone if `every_random`, as the strength of the best of several fits would be biased upwards.

    1. A candidate promises something where its random term or its best mean term gains more than HOPELESS nats; every
       one counts as such if `every_random`.
    2. Where its variants begin with a mean term, each of those with the best random term is fitted whose mean term is
       about as good as the best; each of them where no mean term was screened by itself.
    3. Where they begin with a random term, the best of them is fitted, without companion and with it.
    4. A candidate that promises nothing is a hypothesis as screened, unless it is among `means`, where it has one
       already.

    means: mean effects judged to first order, best first.
    """
    means_of = _about_as_good(means, len(start.terms) + 1)
    unpromising, to_fit = [], []
    for name in dict.fromkeys(v.name for v in variants):
        own, good_means = [v for v in variants if v.name == name], means_of.get(name, [])
        best = max(_screened_random(start, own), key=lambda s: s.gain)
        mean_promises = bool(good_means) and good_means[0].gain - start.gain > HOPELESS
        if every_random or best.gain > HOPELESS or mean_promises:
            fitted_means = good_means[:1] if every_random else good_means
            to_fit += _variants_to_fit(best.variant, own, [m.terms[-1] for m in fitted_means])
        elif not good_means:
            unpromising.append(_hypothesis_of(start, best))
    return unpromising, to_fit


def _about_as_good(means: Sequence[Hypothesis], length: int) -> dict[str, list[Hypothesis]]:
    """By name, the best hypothesis of so many terms, and those of the same effect about as good (ABOUT_AS_GOOD).

    means: best first.
    """
    out: dict[str, list[Hypothesis]] = {}
    for mean in means:
        if len(mean.terms) == length:
            best = out.setdefault(mean.name, [])
            if not best or best[0].gain - mean.gain < ABOUT_AS_GOOD:
                best.append(mean)
    return out


def _screened_random(start: RoundStart, variants: Sequence[PricedVariant]) -> list[ScreenedRandom]:
    """The variants of one effect whose random term stands alone or after a mean one, screened by that random term.

    A gain pays for the choice, but no PRICE as that of a mean effect does: it is that of the random term alone, which
    in the package's effects has one free parameter, and the first is free of charge (`judging.price_of`). What the mean
    term or several parameters of a user's random effect cost is charged when the variant is fitted.
    """
    screened, judged = [], {}  # several variants have the same random term
    for variant in variants:
        first, random = variant.terms[0], random_of(variant.terms)[0]
        if len(variant.terms) > 1 and first.shows_in != MEAN:
            continue
        if random.key not in judged:
            judged[random.key] = judge_random(start.halves, random)
        gain, strength = judged[random.key]
        screened.append(ScreenedRandom(gain - variant.choice_cost, strength, variant))
    return screened


def _variants_to_fit(best: PricedVariant, variants: Sequence[PricedVariant], good_means: Sequence[Term],
                     ) -> list[PricedVariant]:
    """The variants of a promising effect that are fitted.

    best: by its random term; good_means: mean terms about as good as the best, none where none was screened.
    """
    if best.terms[0].shows_in != MEAN:
        return [v for v in variants if _same(v.terms[0], best.terms[0])]
    (random,) = random_of(best.terms)
    return [v for v in variants if _same(random_of(v.terms)[0], random)
            and (not good_means or any(_same(v.terms[0], mean) for mean in good_means))]


def _hypothesis_of(start: RoundStart, screened: ScreenedRandom) -> Hypothesis:
    """A screened random effect as a hypothesis, which gains nothing at most, as it is not fitted."""
    name, terms, cost = screened.variant
    strength = Strength(strength_term(terms).among_all(screened.strength))
    return Hypothesis(name, (*start.terms, *terms), start.gain + min(screened.gain, 0.0), full=False,
                     charges=start.charges.with_effect(cost), strength=strength)


def _same(one: Term, other: Term) -> bool:
    """Whether two terms are the same variant of an effect."""
    fixed = [{k: v for k, v in t.values.items() if k not in t.free} for t in (one, other)]
    return one.name == other.name and one.free == other.free and fixed[0] == fixed[1]
