"""Hypotheses on a flight and their evidence: effects together, or a nameless disturbance.

A flight's coordinates are Q values, of which nominal flights have the covariance 1; evidence is in nats.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.special import logsumexp

from airtouch.gap.relations.density import Fit, Rescaling, fit, log_density, principal, rescaling_of, unchanged
from airtouch.gap.relations.effect_class import EffectClass

TURNS = 3  #: turns, at most, in which the effects of a hypothesis are fitted in turn; chosen
#: lengths of the shift by a nameless disturbance, nominal standard deviations, equally likely; chosen
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
class Hypothesis:
    """Effects at their likeliest strengths.

    peak: log of the likelihood ratio to no effect, nats; evidence: that of the ratio averaged over strengths.
    """

    fits: tuple[Fit, ...]
    peak: float
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

    @cached_property
    def shift(self) -> np.ndarray:
        """Expected shift (Q,); 0 without effects."""
        return np.sum([f.shift for f in self.fits], axis=0)


class FlightHypotheses:
    """The coordinates of a flight, values (Q,), and hypotheses on them."""

    def __init__(self, values: np.ndarray, model: LearnedModel) -> None:
        self.values, self.model = values, model
        self.none = Hypothesis((), 0.0, 0.0)

    def single_effects(self) -> list[Hypothesis]:
        """A hypothesis for every class alone, the likeliest first."""
        return sorted(map(self.with_class, self.model.classes), key=lambda h: -h.evidence)

    def with_class(self, effect_class: EffectClass) -> Hypothesis:
        """The hypothesis of one class alone."""
        base, f = log_density(self.values), fit(effect_class, self.values, self.rescaling(()))
        return Hypothesis((f,), f.peak - base, f.evidence - base)

    def with_one_more(self, hypothesis: Hypothesis, allowed: Callable[[EffectClass, Hypothesis], bool],
                      ) -> list[Hypothesis]:
        """The hypothesis with each allowed class added, the likeliest first; the others keep their strength."""
        rescaling = self.rescaling(hypothesis.fits)
        residual = rescaling(self.values - hypothesis.shift)
        cost = hypothesis.evidence - hypothesis.peak
        out = [self.at_fits((*hypothesis.fits, fit(c, residual, rescaling)), cost)
               for c in self.model.classes if allowed(c, hypothesis)]
        return sorted(out, key=lambda h: -h.evidence)

    def with_two(self, one: EffectClass, two: EffectClass) -> Hypothesis:
        """The hypothesis of two classes: the second fitted beside the first, then both in turn."""
        first = fit(one, self.values, self.rescaling(()))
        rescaling = rescaling_of(first.loadings())
        second = fit(two, rescaling(self.values - first.shift), rescaling)
        return self.refitted(self.at_fits((first, second)))

    def refitted(self, hypothesis: Hypothesis) -> Hypothesis:
        """The hypothesis with its effects fitted in turn, each beside the others."""
        best, fits = hypothesis, list(hypothesis.fits)
        for _ in range(TURNS):
            for i, f in enumerate(fits):
                others = tuple(fits[:i] + fits[i + 1:])
                rescaling, beside = self.rescaling(others), np.sum([o.shift for o in others], axis=0)
                fits[i] = fit(f.effect_class, rescaling(self.values - beside), rescaling)
            tried = self.at_fits(tuple(fits))
            if tried.peak <= best.peak:
                break
            best = tried
        return best

    def squared_distance(self, hypothesis: Hypothesis) -> float:
        """Squared distance of the flight from a hypothesis, relative to the scatter about it."""
        residual = self.rescaling(hypothesis.fits)(self.values - hypothesis.shift)
        return float(residual @ residual)

    def nameless_evidence(self, hypothesis: Hypothesis) -> float:
        """Evidence over none of a hypothesis with a nameless disturbance beside it, nats."""
        rescaling = self.rescaling(hypothesis.fits)
        residual = rescaling(self.values - hypothesis.shift)
        axes, of_unit_length = principal(rescaling(self.model.nameless.T).T)
        along = (residual @ axes) ** 2
        variance = 1.0 + np.outer(NAMELESS_LENGTHS ** 2, of_unit_length)  # (lengths, r)
        gain = 0.5 * ((along * (1.0 - 1.0 / variance)) - np.log(variance)).sum(axis=1)
        density = rescaling.log_determinant + log_density(residual)
        averaged = float(logsumexp(density + gain) - np.log(len(gain)))
        return averaged - log_density(self.values) + hypothesis.evidence - hypothesis.peak

    def at_fits(self, fits: Sequence[Fit], cost: float | None = None) -> Hypothesis:
        """The hypothesis of effects at the strengths of their fits.

        cost: nats that averaging over the strengths of all but the last changes, if known.
        """
        rescaling = self.rescaling(fits)
        residual = rescaling(self.values - np.sum([f.shift for f in fits], axis=0))
        peak = rescaling.log_determinant + log_density(residual) - log_density(self.values)
        own = [f.evidence - f.peak for f in fits]
        return Hypothesis(tuple(fits), peak, peak + (sum(own) if cost is None else cost + own[-1]))

    def rescaling(self, fits: Sequence[Fit]) -> Rescaling:
        """The rescaling by which the scatter of a flight under effects has the covariance 1; none changes nothing."""
        if not fits:
            return unchanged(len(self.values))
        lengths = [float(np.linalg.norm(f.shift)) for f in fits]
        smaller = float(np.sqrt(sum(min(a, b) ** 2 for a, b in combinations(lengths, 2))))
        interaction = [smaller * self.model.interaction] if smaller else []
        return rescaling_of(np.concatenate([*(f.loadings() for f in fits), *interaction], axis=1))
