"""The effects named: fitted to all the data, in the median shape, with 90 % intervals."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.special import logsumexp

from airtouch.gap.answer.estimates import Estimate, from_spectra, from_times, with_reading
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import FittedTerms, converged, fit
from airtouch.gap.evidence.judge import judge
from airtouch.gap.evidence.problem import BlockSet, whole_of
from airtouch.gap.naming.records import Hypothesis, Selection
from airtouch.gap.relations.readout import Reading
from airtouch.gap.result import NamedEffect
from airtouch.gap.second_process import map_on_two_cores
from airtouch.gap.signatures.signature import CLOCK, SPECTRUM
from airtouch.gap.signatures.term import Term

#: lower bound of the divisor of a random part, the effect's strength; chosen, far below any that is named
LEAST_STRENGTH = 1e-6


def named_effects(data: Data, selection: Selection) -> list[NamedEffect]:
    """The effects that a selection names, fitted anew to all the data, with 90 % intervals.

    They have the order of the selection: the first leads the ranking.
    """
    hypothesis, named = selection.last_step, selection.named_hypothesis
    if hypothesis is None or named is None:
        return []
    readings = selection.inference.readings if selection.inference is not None else {}
    in_spectra = [t for t in hypothesis.terms if t.shows_in != CLOCK]
    fitted = median_shape_fit(data, whole_of(data), in_spectra, _mean_of_halves(hypothesis))
    named_terms = [t for t in fitted.terms if t.slot in selection.named_slots]
    effects = [_named(t, from_spectra(data, t, fitted, hypothesis.fits), readings)
               for t in named_terms if not t.companion]
    for random_part in (t for t in named_terms if t.companion and t.shows_in == SPECTRUM):
        effects = [with_random_part(e, random_part) for e in effects]
    effects += [_named(t, from_times(data, t), readings) for t in named.terms if t.shows_in == CLOCK]
    order = [s.name for s in selection.named_steps]
    return sorted(effects, key=lambda e: order.index(e.name))


def _named(term: Term, estimate: Estimate, readings: Mapping[str, Mapping[str, Reading]]) -> NamedEffect:
    """An effect with an estimate of its parameters, and with its reading where there is one."""
    x, covariance = with_reading(term, estimate, readings.get(term.name, {}))
    return NamedEffect(term.name, term.quantities(x, covariance), term.gate)


def median_shape_fit(data: Data, all_blocks: BlockSet, terms: Sequence[Term], start: np.ndarray | None,
                     ) -> FittedTerms:
    """Effects fitted to all the data, each in the median of its shapes: as likely one before it as one after it.

    start: scaled parameters from which each fit begins. All shapes of an effect are as likely before the data. Where
    the data can hardly tell them apart, the likeliest is one at the end of the list as often as not; the median is not.
    """
    chosen, fitted = list(terms), None
    for i, term in enumerate(terms):
        shapes = term.shaped()
        if shapes:
            fits = map_on_two_cores(partial(_fitted_and_judged, data, all_blocks, start),
                                    [[*chosen[:i], shape, *chosen[i + 1:]] for shape in shapes])
            median = median_index([log_likelihood for _, log_likelihood in fits])
            chosen[i], fitted = shapes[median], fits[median][0]
    return converged(data, all_blocks, fitted or fit(data, all_blocks, terms, start))


def _fitted_and_judged(data: Data, blocks: BlockSet, start: np.ndarray | None, terms: Sequence[Term],
                       ) -> tuple[FittedTerms, float]:
    """Effects fitted to some blocks, and the log likelihood of these, nats."""
    fitted = fit(data, blocks, terms, start)
    return fitted, judge(data, blocks, fitted.terms)


def median_index(log_likelihoods: Sequence[float]) -> int:
    """Number of the median of alternatives in their order, equally likely before the data, nats (n,)."""
    probability = np.exp(log_likelihoods - logsumexp(log_likelihoods))
    return int(np.searchsorted(np.cumsum(probability), 0.5))


def with_random_part(effect: NamedEffect, random_part: Term) -> NamedEffect:
    """The effect with its random part as fitted, so that a simulator can switch it on unchanged.

    The random part was fitted at a strength of its own (1, that of the published curve), while the simulator has one
    strength for mean and random part: the random part's parameters are divided by it. A mean too weak to carry them
    within their bounds is raised to the least that does. What tells the random part's variants apart stays as it is.
    """
    if effect.name != random_part.name:
        return effect
    (name,) = random_part.signature.free  # of the strength
    fitted = {k: random_part.values[name] * random_part.values[k] for k in random_part.free}  # at strength 1
    of_mean, bounds = effect.parameters[name], {p.name: p.high for p in random_part.effect.parameters}
    strength = max(of_mean.value, *(value / bounds[k] for k, value in fitted.items()), LEAST_STRENGTH)
    high = strength if of_mean.high is None else max(of_mean.high, strength)
    values = {k: value / strength for k, value in fitted.items()} \
        | {k: random_part.values[k] for k in random_part.signature.random_variant_parameters}
    of_random = {k: replace(effect.parameters[k], value=value) for k, value in values.items()}
    parameters = {**effect.parameters, name: replace(of_mean, value=strength, high=high), **of_random}
    return NamedEffect(effect.name, parameters, effect.seconds)


def _mean_of_halves(hypothesis: Hypothesis) -> np.ndarray | None:
    """Mean of the scaled parameters that the two halves of the data gave, None where none is free."""
    scaled = [f.scaled for f in hypothesis.fits]
    return np.mean(scaled, axis=0) if scaled and len(scaled[0]) else None
