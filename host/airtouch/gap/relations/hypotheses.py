"""Which effects together, or something without a name: hypotheses on the features of a flight and their evidence."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.special import logsumexp

from airtouch.gap.relations.density import Coordinates, Fit, coordinates_of, far, fit, plain
from airtouch.gap.relations.effect_class import EffectClass

ROUNDS = 3  #: in which the effects of a hypothesis are fitted in turn
SIZES = np.geomspace(3.0, 300.0, 10)  #: of a disturbance without a name, each as likely


@dataclass(frozen=True)
class Learned:
    """What was learned from simulated flights: classes of effects; together (Q, r): directions, times the deviation, in

    which two effects are more or less than their sum, over the size of the smaller; nameless (Q, r): the same of
    disturbances without a name, over their size.
    """

    classes: tuple[EffectClass, ...]
    together: np.ndarray
    nameless: np.ndarray


@dataclass(frozen=True)
class Hypothesis:
    """Effects at their likeliest strengths.

    level: log density over none; evidence: the same averaged over strengths.
    """

    fits: tuple[Fit, ...]
    level: float
    evidence: float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the kinds of effects."""
        return tuple(f.of.name for f in self.fits)

    @property
    def effects(self) -> frozenset[str]:
        """Names of the effects in the registry."""
        return frozenset(f.of.effect for f in self.fits)

    @cached_property
    def shift(self) -> np.ndarray:
        """Expected shift (Q,)."""
        return np.sum([f.shift for f in self.fits], axis=0)


class Flown:
    """The features of a flight less those of nominal ones (Q,), and hypotheses on them."""

    def __init__(self, values: np.ndarray, learned: Learned) -> None:
        self.values, self.learned = values, learned
        self.none = Hypothesis((), 0.0, 0.0)

    def singles(self) -> list[Hypothesis]:
        """Every class alone, the best first."""
        base = far(self.values)
        made = [fit(c, self.values, plain(len(self.values))) for c in self.learned.classes]
        return sorted((Hypothesis((f,), f.level - base, f.evidence - base) for f in made), key=lambda h: -h.evidence)

    def beside(self, held: Hypothesis, allowed: Callable[[EffectClass, Hypothesis], bool]) -> list[Hypothesis]:
        """Every class that may stand beside a hypothesis on top of it, the best first; fitted in turn once."""
        known = self.coordinates(held.fits)
        left = known(self.values - held.shift)
        out = []
        for c in self.learned.classes:
            if allowed(c, held):
                more = fit(c, left, known)
                out.append(self.judged((*held.fits, more), held.evidence - held.level))
        return sorted(out, key=lambda h: -h.evidence)

    def settled(self, found: Hypothesis) -> Hypothesis:
        """A hypothesis whose effects are fitted in turn, each beside the others."""
        best, fits = found, list(found.fits)
        for _ in range(ROUNDS):
            for i, f in enumerate(fits):
                others = tuple(fits[:i] + fits[i + 1:])
                known = self.coordinates(others)
                fits[i] = fit(f.of, known(self.values - np.sum([o.shift for o in others], axis=0)), known)
            tried = self.judged(tuple(fits))
            if tried.level <= best.level:
                break
            best = tried
        return best

    def distance(self, found: Hypothesis) -> float:
        """Squared distance of the flight from effects, over the scatter about them."""
        left = self.coordinates(found.fits)(self.values - found.shift) if found.fits else self.values
        return float(left @ left)

    def nameless(self, beside: Hypothesis) -> float:
        """Evidence over none of a hypothesis with a disturbance beside it that has no name."""
        known = self.coordinates(beside.fits) if beside.fits else plain(len(self.values))
        left = known(self.values - (beside.shift if beside.fits else 0.0))
        ways, size, _ = np.linalg.svd(known(self.learned.nameless.T).T, full_matrices=False)
        along = (left @ ways) ** 2
        grown = 1.0 + np.outer(SIZES ** 2, size ** 2)
        level = known.level + far(left) + 0.5 * ((along * (1.0 - 1.0 / grown)) - np.log(grown)).sum(axis=1)
        averaged = float(logsumexp(level) - np.log(len(SIZES)))
        return averaged - far(self.values) + beside.evidence - beside.level

    def judged(self, fits: Sequence[Fit], occam: float | None = None) -> Hypothesis:
        """Effects at the strengths of their fits. occam: what the strengths of all but the last may cost, if known."""
        known = self.coordinates(fits)
        level = known.level + far(known(self.values - np.sum([f.shift for f in fits], axis=0))) - far(self.values)
        cost = sum(f.evidence - f.level for f in fits) if occam is None else occam + fits[-1].evidence - fits[-1].level
        return Hypothesis(tuple(fits), level, level + cost)

    def coordinates(self, fits: Sequence[Fit]) -> Coordinates:
        """Coordinates for the scatter of a flight under effects."""
        sizes = [float(np.linalg.norm(f.shift)) for f in fits]
        smaller = float(np.sqrt(sum(min(a, b) ** 2 for a, b in combinations(sizes, 2))))
        return coordinates_of(np.concatenate([*(f.factors() for f in fits),
                                              *([smaller * self.learned.together] if smaller else [])], axis=1))
