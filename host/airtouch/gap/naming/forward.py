"""Forward selection: effects are added one by one while held-out data ask for them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from airtouch.gap.naming.evidence import with_evidence
from airtouch.gap.naming.judging import Trial
from airtouch.gap.naming.policy import (
    CERTAIN,
    FIRST_GAIN,
    MISFIT_SHARE_DEVIATION,
    MOST_DEVIATIONS,
    MOST_EFFECTS,
    PASSING_GAIN,
    SURE_EVIDENCE,
    TEMPERATURE,
    WORTH_AGAIN,
)
from airtouch.gap.naming.records import Hypothesis, Step
from airtouch.gap.naming.rounds import best_beside, round_of
from airtouch.gap.naming.thresholds import is_random_misfit, least_further_gain
from airtouch.gap.signatures.candidates import is_random
from airtouch.gap.signatures.term import Terms


@dataclass(frozen=True)
class Search:
    """The flights, and the candidates among which effects are searched.

    candidates: variants of each effect by name; progress: called with each name that is judged.
    """

    trial: Trial
    candidates: Mapping[str, Sequence[Terms]]
    progress: Callable[[str], None]

    @cached_property
    def fitted_alone(self) -> Mapping[str, Hypothesis]:
        """Every candidate alone, by name, without evidence; worked out when it is first asked for."""
        return best_beside(self.trial, self.candidates, None, self.progress)

    @cached_property
    def single_effects(self) -> Mapping[str, Hypothesis]:
        """Every candidate judged alone, by name; worked out when it is first asked for."""
        return with_evidence(self.trial.data, self.fitted_alone, 0.0)

    @cached_property
    def least_nats(self) -> Mapping[str, float]:
        """What each candidate must gain to be the first step."""
        return dict.fromkeys(self.candidates, self.trial.policy.least_evidence)


class Extension(NamedTuple):
    """A hypothesis that adds a candidate to the last step, and the nats that it must gain over that step."""

    hypothesis: Hypothesis
    required_gain: float


@dataclass(frozen=True)
class PartialSelection:
    """What a forward selection has added so far, and what it may add next.

    steps: the hypotheses so far, each with the effects of those before it; extensions: candidates judged beside the
    last step, by name; single_effects: the best hypothesis of every candidate, judged before an effect was named;
    least_nats: what each must gain to be the first step.
    """

    steps: tuple[Step, ...]
    extensions: Mapping[str, Extension]
    single_effects: Mapping[str, Hypothesis]
    least_nats: Mapping[str, float]

    @property
    def gain(self) -> float:
        """Held-out nats that the last step gains over no effect."""
        return self.steps[-1].gain if self.steps else 0.0

    @property
    def names(self) -> list[str]:
        """Names of the effects that are named, in the order of the steps."""
        return [s.name for s in self.steps if s.is_named]

    @property
    def deviations(self) -> int:
        """How many steps are not named: deviations that nominal flights have as well."""
        return len(self.steps) - len(self.names)


def forward(search: Search, passing: Hypothesis | None) -> PartialSelection:
    """The forward selection with all steps that held-out data ask for.

    passing: a passing effect, which is the first step; None for none.
    """
    partial = _first_selection(search, passing)
    while len(partial.names) < MOST_EFFECTS:
        least = search.trial.policy.least_evidence
        best = _best_of(_sufficient_extensions(partial, least), partial.gain, least)
        if best is None:
            break
        partial = _with_step(search, partial, best)
    return partial


def _first_selection(search: Search, passing: Hypothesis | None) -> PartialSelection:
    """The selection before the first effect is added, with a passing effect as a step already."""
    if passing is None:
        extensions = {n: Extension(h, search.least_nats[n]) for n, h in search.single_effects.items()}
        return PartialSelection((), extensions, search.single_effects, search.least_nats)
    single_effects = {**search.single_effects, passing.name: passing}
    steps = (Step.of(passing),)
    extensions = _extensions(search, steps, single_effects, {n: c.gain for n, c in single_effects.items()})
    return PartialSelection(steps, extensions, single_effects, {**search.least_nats, passing.name: PASSING_GAIN})


def _sufficient_extensions(partial: PartialSelection, least_evidence: float) -> list[Hypothesis]:
    """Extensions that gain enough over the last step; beside MOST_DEVIATIONS those alone that would be named."""
    extensions = partial.extensions.values()
    sufficient = [e.hypothesis for e in extensions if e.hypothesis.gain - partial.gain >= e.required_gain]
    if partial.deviations >= MOST_DEVIATIONS:  # a random effect that another leaves may be one more
        return [h for h in sufficient if h.evidence >= least_evidence]
    return sufficient


def _best_of(extensions: Sequence[Hypothesis], before: float, least_evidence: float) -> Hypothesis | None:
    """The best of the extensions that were fitted in full; None where there is none.

    Likelihoods of real flights are too sure of themselves (TEMPERATURE). So of two that gain nearly as much the one is
    better whose strength is the rarer in nominal flights. A deviation that nominal flights have as well is added before
    an effect with evidence only where it gains more by a share MISFIT_SHARE_DEVIATION, as no model is exact.

    before: nats that the last step gains over no effect; least_evidence: nats of evidence that a name needs.
    """
    full = [h for h in extensions if h.full]

    def merit(hypothesis: Hypothesis) -> float:
        return hypothesis.gain / TEMPERATURE + min(hypothesis.evidence, CERTAIN)

    best = max(full, key=merit, default=None)
    if best is None or best.evidence >= least_evidence:
        return best
    least = before + (1.0 - MISFIT_SHARE_DEVIATION) * (best.gain - before)
    as_good = [h for h in full if h.evidence >= least_evidence and h.gain >= least]
    return max(as_good, key=merit, default=best)


def _with_step(search: Search, partial: PartialSelection, best: Hypothesis) -> PartialSelection:
    """The selection with a further step: named, or a deviation where its evidence or gain is too small for a name."""
    beside_last = {n: e.hypothesis for n, e in partial.extensions.items()}
    single_effects = partial.single_effects
    if not partial.names:  # what nominal flights have as well stands beside every candidate
        step_names = {s.name for s in partial.steps}
        single_effects = {**single_effects, **{n: h for n, h in beside_last.items() if n not in step_names}}
    is_misfit = bool(partial.names) and is_random_misfit(search.trial, partial.steps[-1], best)
    has_evidence = best.evidence >= search.trial.policy.least_evidence
    steps = (*partial.steps, Step.of(best, is_named=has_evidence and not is_misfit))
    after = replace(partial, steps=steps, single_effects=single_effects)
    if len(after.names) >= MOST_EFFECTS:  # nothing is added to these
        return after
    further_gains = {n: c.gain - partial.gain for n, c in beside_last.items()}
    return replace(after, extensions=_extensions(search, steps, beside_last, further_gains))


def _extensions(search: Search, steps: Sequence[Step], before: Mapping[str, Hypothesis],
                further_gains: Mapping[str, float]) -> dict[str, Extension]:
    """Every candidate beside the steps so far, with the nats that each must gain.

    before: hypotheses of candidates as judged before the newest step; further_gains: nats that each of them gained over
    the steps then. Beside a deviation of nominal flights, if it is the newest step, only those are judged again that
    gained something without it, as a deviation takes gain from others and seldom adds any.
    """
    trial, any_named = search.trial, any(s.is_named for s in steps)
    gaining_names = {n for n, gain in further_gains.items() if gain > WORTH_AGAIN * FIRST_GAIN}
    candidates = {n: v for n, v in search.candidates.items() if steps[-1].is_named or n in gaining_names}
    sure_names = {n for n, h in before.items() if h.full and h.evidence >= SURE_EVIDENCE and not is_random(n)}
    best = round_of(trial, candidates, steps[-1], search.progress, promising=sure_names)
    return {n: Extension(c, least_further_gain(trial, steps[-1], c) if any_named else trial.policy.least_evidence)
            for n, c in best.items()}
