"""Hypotheses on a flight and their evidence: effects together, or a nameless disturbance.

A flight's coordinates are Q values, of which nominal flights have the covariance 1. The evidence for a hypothesis is
the log of its Bayes factor over no effect, in nats.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.special import logsumexp

from airtouch.gap.relations.density import Fit, Rescaling, fit, log_density, principal, rescaling_of, unchanged
from airtouch.gap.relations.effect_class import EffectClass

#: rounds, at most, in which each effect of a hypothesis is fitted beside the others; chosen. A smaller number ends fits
#: of effects that trade against each other too early
MOST_ROUNDS = 3
#: lengths of the shift by a nameless disturbance, nominal standard deviations, equally likely; chosen. With a smaller
#: first one it gains more in flights that hardly shift; with a larger last one it explains stronger disturbances
NAMELESS_LENGTHS = np.geomspace(3.0, 300.0, 10)


@dataclass(frozen=True)
class LearnedModel:
    """What was learned from simulated flights: classes of effects, their interaction, nameless disturbances.

    interaction (Q, r): directions, times the standard deviation, in which two effects are not their sum, relative to
    the length of the smaller one's shift; nameless (Q, r): the same of nameless disturbances, relative to their length.
    """

    classes: tuple[EffectClass, ...]
    interaction: np.ndarray
    nameless: np.ndarray


@dataclass(frozen=True)
class RelationsHypothesis:
    """Effects at their likeliest strengths, with two log ratios over no effect, nats.

    log_likelihood_ratio: of the densities of the flight, at these strengths; evidence: of the density averaged over
    strengths (the log of the Bayes factor).
    """

    fits: tuple[Fit, ...]
    log_likelihood_ratio: float
    evidence: float

    @property
    def classes(self) -> tuple[EffectClass, ...]:
        """The classes of the effects."""
        return tuple(f.effect_class for f in self.fits)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the classes."""
        return tuple(c.name for c in self.classes)

    @property
    def effect_names(self) -> tuple[str, ...]:
        """Names of the classes' effects in the registry, in their order."""
        return tuple(c.effect for c in self.classes)

    @property
    def log_occam_factor(self) -> float:
        """Nats, 0 or less, by which averaging over the strengths lowers the log likelihood ratio."""
        return self.evidence - self.log_likelihood_ratio

    @cached_property
    def shift(self) -> np.ndarray:
        """Expected shift (Q,); 0 without effects."""
        return np.sum([f.shift for f in self.fits], axis=0)


class FlightHypotheses:
    """The coordinates of a flight, values (Q,), and hypotheses on them."""

    def __init__(self, values: np.ndarray, model: LearnedModel) -> None:
        self.values, self.model = values, model
        self.no_effect = RelationsHypothesis((), 0.0, 0.0)

    def single_effects(self) -> list[RelationsHypothesis]:
        """A hypothesis for every class alone, the likeliest first."""
        return sorted(map(self.with_class, self.model.classes), key=lambda h: -h.evidence)

    def with_class(self, effect_class: EffectClass) -> RelationsHypothesis:
        """The hypothesis of one class alone."""
        base, f = log_density(self.values), fit(effect_class, self.values, self.rescaling(()))
        return RelationsHypothesis((f,), f.log_peak - base, f.log_marginal - base)

    def with_one_more(self, hypothesis: RelationsHypothesis,
                      allowed: Callable[[EffectClass, RelationsHypothesis], bool]) -> list[RelationsHypothesis]:
        """The hypothesis with each allowed class added, the likeliest first; the others keep their strength."""
        rescaling = self.rescaling(hypothesis.fits)
        residual = rescaling(self.values - hypothesis.shift)
        log_occam_factor = hypothesis.log_occam_factor
        out = [self.at_fits((*hypothesis.fits, fit(c, residual, rescaling)), log_occam_factor)
               for c in self.model.classes if allowed(c, hypothesis)]
        return sorted(out, key=lambda h: -h.evidence)

    def with_two(self, one: EffectClass, two: EffectClass) -> RelationsHypothesis:
        """The hypothesis of two classes: the second fitted beside the first, then both in turn."""
        first = fit(one, self.values, self.rescaling(()))
        rescaling = rescaling_of(first.loadings())
        second = fit(two, rescaling(self.values - first.shift), rescaling)
        return self.refitted(self.at_fits((first, second)))

    def refitted(self, hypothesis: RelationsHypothesis) -> RelationsHypothesis:
        """The hypothesis with its effects fitted in turn, each beside the others."""
        best, fits = hypothesis, list(hypothesis.fits)
        for _ in range(MOST_ROUNDS):
            for i, f in enumerate(fits):
                others = tuple(fits[:i] + fits[i + 1:])
                rescaling, beside = self.rescaling(others), np.sum([o.shift for o in others], axis=0)
                fits[i] = fit(f.effect_class, rescaling(self.values - beside), rescaling)
            trial = self.at_fits(tuple(fits))
            if trial.log_likelihood_ratio <= best.log_likelihood_ratio:
                break
            best = trial
        return best

    def squared_distance(self, hypothesis: RelationsHypothesis) -> float:
        """Squared distance of the flight from a hypothesis, relative to the scatter about it."""
        residual = self.rescaling(hypothesis.fits)(self.values - hypothesis.shift)
        return float(residual @ residual)

    def nameless_evidence(self, hypothesis: RelationsHypothesis) -> float:
        """Evidence over none of a hypothesis with a nameless disturbance beside it, nats."""
        rescaling = self.rescaling(hypothesis.fits)
        residual = rescaling(self.values - hypothesis.shift)
        axes, of_unit_length = principal(rescaling(self.model.nameless.T).T)
        along = (residual @ axes) ** 2
        variance = 1.0 + np.outer(NAMELESS_LENGTHS ** 2, of_unit_length)  # (lengths, r)
        gain = 0.5 * ((along * (1.0 - 1.0 / variance)) - np.log(variance)).sum(axis=1)
        density = rescaling.log_determinant + log_density(residual)
        averaged = float(logsumexp(density + gain) - np.log(len(gain)))
        return averaged - log_density(self.values) + hypothesis.evidence - hypothesis.log_likelihood_ratio

    def at_fits(self, fits: Sequence[Fit], log_occam_factor: float | None = None) -> RelationsHypothesis:
        """The hypothesis of effects at the strengths of their fits.

        log_occam_factor: that of all effects but the last, if known; else the sum of those of their fits.
        """
        rescaling = self.rescaling(fits)
        residual = rescaling(self.values - np.sum([f.shift for f in fits], axis=0))
        ratio = rescaling.log_determinant + log_density(residual) - log_density(self.values)
        factors = [f.log_occam_factor for f in fits]
        total = sum(factors) if log_occam_factor is None else log_occam_factor + factors[-1]
        return RelationsHypothesis(tuple(fits), ratio, ratio + total)

    def rescaling(self, fits: Sequence[Fit]) -> Rescaling:
        """The rescaling by which the scatter of a flight under effects has the covariance 1; none changes nothing."""
        if not fits:
            return unchanged(len(self.values))
        lengths = [float(np.linalg.norm(f.shift)) for f in fits]
        smaller = float(np.sqrt(sum(min(a, b) ** 2 for a, b in combinations(lengths, 2))))
        interaction = [smaller * self.model.interaction] if smaller else []
        return rescaling_of(np.concatenate([*(f.loadings() for f in fits), *interaction], axis=1))
