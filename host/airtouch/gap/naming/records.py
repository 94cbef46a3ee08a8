"""The result of a selection of effects: hypotheses with what they gain, and the steps.

A *candidate* is an effect that is tried, and has a name. A `Hypothesis` is one candidate or several together, in one
variant each, with what they gain.
"""

from collections.abc import Container, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.fit import FittedTerms
from airtouch.gap.evidence.problem import BlockSet
from airtouch.gap.naming.policy import NamingPolicy
from airtouch.gap.relations.inference import Inference
from airtouch.gap.signatures.signature import CLOCK
from airtouch.gap.signatures.term import Term, Terms


@dataclass(frozen=True)
class Strength:
    """Scaled parameters of one term, as both halves of the flights have them.

    mean (k,): of both halves, 0 for parameters that the variant does not free; covariance (k, k): of estimation, 0 but
    for mean effects, infinite for parameters that are not free, empty where none was estimated; half_difference (k,):
    half the difference of the halves. k: the number of parameters that the effect may have free.
    """

    mean: np.ndarray = field(default_factory=lambda: np.zeros(0))
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    half_difference: np.ndarray | float = 0.0

    @property
    def variance(self) -> np.ndarray:
        """Variance (k,) of the mean, no less than what the halves differ by says.

        Where the likelihood has two peaks, its curvature at one of them knows nothing of the other.
        """
        return np.maximum(np.diag(self.covariance), np.square(self.half_difference))


@dataclass(frozen=True)
class Charges:
    """What is subtracted from the gain of a hypothesis beside the price of its parameters, and what is added, nats.

    choice_cost: subtracted for the choice among the variants of each of its effects, all together; newest_choice_cost:
    of these, for the newest effect; uncertain_floor_loss: added. With the first random effect the floor of the commands
    counts as less certain, so that the effects before it gain less by this much, though they are no less right.
    """

    choice_cost: float = 0.0
    newest_choice_cost: float = 0.0
    uncertain_floor_loss: float = 0.0

    def with_effect(self, choice_cost: float, uncertain_floor_loss: float = 0.0) -> "Charges":
        """The charges with those of a further effect."""
        return Charges(choice_cost + self.choice_cost, choice_cost, self.uncertain_floor_loss + uncertain_floor_loss)


@dataclass(frozen=True)
class Hypothesis:
    """One effect or several that may act together, with what they gain.

    name: the effect that it adds to those of its base, its newest; terms: of all its effects, with their values; gain:
    held-out nats over no effect, after `charges`; fits: of its terms in the spectra to each half, none where it has no
    such term or was only screened; full: whether it was fitted to the end, not screened or fitted briefly.

    Of the newest effect alone: strength; evidence: nats that it gains over the base, but no more than its strength says
    beyond the scatter of nominal flights, 0 where the relations of signals decide and nobody asks; passing_key: of a
    passing effect, the entry of `Scatter.passing` that it is compared with, else None.
    """

    name: str
    terms: Terms
    gain: float
    fits: tuple[FittedTerms, ...] = ()
    full: bool = True
    charges: Charges = Charges()
    strength: Strength = field(default_factory=Strength)
    evidence: float = 0.0
    passing_key: str | None = None

    @property
    def of_the_log(self) -> bool:
        """Whether the newest effect is a fault of the log's own times."""
        return any(t.name == self.name and t.shows_in == CLOCK for t in self.terms)


@dataclass(frozen=True)
class Step(Hypothesis):
    """A hypothesis that a selection has added: its effects are those of the step before, and a newest one.

    is_named: whether its evidence is enough for a name; if not, the newest effect is a deviation that nominal flights
    have as well, and stands beside the effects named. leave_one_out_gain: what the newest adds to the others, nats: of
    effects that are named where there are several, and of a passing one beside any step; else None.
    """

    is_named: bool = True
    leave_one_out_gain: float | None = None

    @classmethod
    def of(cls, hypothesis: Hypothesis, is_named: bool = True) -> "Step":
        """The step that adds a hypothesis."""
        return cls(**vars(hypothesis), is_named=is_named)


@dataclass(frozen=True)
class NamelessGain:
    """Held-out nats that the nameless model gains; 0 where the relations of signals decide, which do not use it.

    over_none: over no effect; over_last_step: over the last step of the selection; outside_spectra: of the latter, what
    logged times and echo of noise hold.
    """

    over_none: float = 0.0
    over_last_step: float = 0.0
    outside_spectra: float = 0.0


class OverPrediction(NamedTuple):
    """Held-out nats lost where effects predict what flights do not show, and the number of the worst cell (`cells`)."""

    nats: float = 0.0
    worst_cell: int | None = None


class UnsteadinessRarity(NamedTuple):
    """How rare it is that nominal flights are as unsteady; 0 nats where that is not judged.

    nats: log likelihood by which the flights are less steady than nominal ones (`passing.unsteadiness`,
    `Scatter.rarity`); limit: nats that one nominal flight in a hundred exceeds; rarest: which is rarest of the measures
    of `unsteadiness.COLUMNS`.
    """

    nats: float = 0.0
    limit: float = 1.0
    rarest: str = ""


class OutgainedPassing(NamedTuple):
    """A passing effect that gains no more nats than it needs beside the effect that always acts and gains most.

    gain: of the passing effect; steady_name, steady_gain: of that other one.
    """

    gain: float
    steady_name: str
    steady_gain: float


class WithdrawnNames(NamedTuple):
    """Effects whose names were withdrawn, as their shrink of recorded flights' gap, together, is too small."""

    names: tuple[str, ...] = ()
    shrink: float = 0.0


@dataclass(frozen=True)
class Selection:
    """The result of a selection of effects; gains are in held-out nats.

    single_effects: the best hypothesis of every candidate, by name, beside the deviations alone; steps: effects added
    one after another; nameless: what the nameless model gains; halves: the blocks that effects were fitted and judged
    on; least_nats: what each candidate must gain to be the first step, and have as evidence to count as more likely
    than none; policy: what the flights must show; spectrum_is_assumed: whether that of an effect of the last step is,
    as the effect is random or changes the loop of recorded flights; over_prediction: that of the effects named;
    inference: what named the effects, where the relations of signals did; library_holds: whether a library of these
    relations holds for the flights, also where the replay named the effects; withdrawn: names that were withdrawn;
    unsteadiness_rarity: how much less steady the flights are than nominal ones; outgained: passing effects, by name,
    that would be named but for one that always acts.
    """

    single_effects: Mapping[str, Hypothesis]
    steps: tuple[Step, ...]
    nameless: NamelessGain
    halves: tuple[BlockSet, BlockSet]
    least_nats: Mapping[str, float]
    policy: NamingPolicy
    spectrum_is_assumed: bool
    over_prediction: OverPrediction = OverPrediction()
    inference: Inference | None = None
    library_holds: bool = False
    withdrawn: WithdrawnNames = WithdrawnNames()
    unsteadiness_rarity: UnsteadinessRarity = UnsteadinessRarity()
    outgained: Mapping[str, OutgainedPassing] = field(default_factory=dict)

    @property
    def last_step(self) -> Step | None:
        """The effects named and the deviations that nominal flights have as well, as one hypothesis."""
        return self.steps[-1] if self.steps else None

    @property
    def named_steps(self) -> tuple[Step, ...]:
        """The steps whose effects are named: what adds most to the others first, faults of the log's own times last."""
        steps = (s for s in self.steps if s.is_named)
        return tuple(sorted(steps, key=lambda s: (s.of_the_log, -(s.leave_one_out_gain or 0.0))))

    @property
    def named_hypothesis(self) -> Hypothesis | None:
        """The effects named, as fitted beside the deviations, as one hypothesis; None where none is."""
        last, slots = self.last_step, self.named_slots
        if last is None or not slots:
            return None
        fits = tuple(replace(f, terms=_in_slots(f.terms, slots)) for f in last.fits)
        return replace(last, terms=_in_slots(last.terms, slots), fits=fits)

    @property
    def named_slots(self) -> frozenset[Hashable]:
        """Slots (`Term.slot`) of the terms of the effects named: a deviation may have the same name."""
        return frozenset(t.slot for i, s in enumerate(self.steps) if s.is_named for t in new_terms(self.steps, i))

    def gain(self, hypothesis: Hypothesis) -> float:
        """Nats that a single effect gains: of held-out data, or of the relations of signals where these decide."""
        return float(self.inference.evidence[hypothesis.name] if self.inference is not None else hypothesis.gain)


def new_terms(steps: Sequence[Step], index: int) -> list[Term]:
    """The terms that the step at an index has added to those before it: an effect, its random part, its companion."""
    before = {t.slot for t in steps[index - 1].terms} if index else set()
    return [t for t in steps[index].terms if t.slot not in before]


def _in_slots(terms: Terms, slots: Container[Hashable]) -> Terms:
    """The terms whose slot is among these."""
    return tuple(t for t in terms if t.slot in slots)
