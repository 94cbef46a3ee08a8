"""Forward selection: effects are added one by one while held-out data ask for them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from airtouch.gap.naming.judging import Trial
from airtouch.gap.naming.leave_one_out import with_leave_one_out_gains
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
from airtouch.gap.naming.records import Candidate, Step
from airtouch.gap.naming.rounds import round_of
from airtouch.gap.naming.thresholds import is_random_misfit, least_further_gain
from airtouch.gap.signatures.candidates import is_random
from airtouch.gap.signatures.term import Terms


@dataclass(frozen=True)
class Search:
    """The flights, and the candidates among which effects are searched.

    candidates: variants of each effect by name; singles: every candidate judged alone; least_gain: nats that each must
    gain as the first effect; progress: called with each name that is judged.
    """

    trial: Trial
    candidates: Mapping[str, Sequence[Terms]]
    singles: Mapping[str, Candidate]
    least_gain: Mapping[str, float]
    progress: Callable[[str], None]


@dataclass(frozen=True)
class State:
    """Where a forward selection stands.

    steps: the hypotheses so far, each with the effects of those before it; extensions: candidates judged beside the
    last step, by name; least_further_gain: nats that each of these must gain over it; singles: the best variant of
    every candidate, as judged before an effect was named; least_gain: nats that each must gain as the first effect.
    """

    steps: tuple[Step, ...]
    extensions: Mapping[str, Candidate]
    least_further_gain: Mapping[str, float]
    singles: Mapping[str, Candidate]
    least_gain: Mapping[str, float]

    @property
    def gain(self) -> float:
        """Held-out nats that the last step gains over no effect."""
        return self.steps[-1].gain if self.steps else 0.0

    @property
    def named(self) -> list[str]:
        """Names of the effects that are named, in the order of the steps."""
        return [s.name for s in self.steps if s.named]

    @property
    def deviations(self) -> int:
        """How many steps are not named: deviations that nominal flights have as well."""
        return len(self.steps) - len(self.named)


def forward(search: Search, passing: Candidate | None) -> State:
    """The state in which a forward selection ends, its steps with their leave-one-out gains.

    passing: an effect that comes and goes, which is the first step; None for none.
    """
    state = _begun(search, passing)
    while len(state.named) < MOST_EFFECTS:
        best = _best_of(_worth_adding(state), state.gain)
        if best is None:
            break
        state = _added(search, state, best)
    return replace(state, steps=tuple(with_leave_one_out_gains(search.trial, state.steps)))


def _begun(search: Search, passing: Candidate | None) -> State:
    """The state before the first effect is added, with an effect that comes and goes as a step already."""
    if passing is None:
        return State((), search.singles, search.least_gain, search.singles, search.least_gain)
    singles = {**search.singles, passing.name: passing}
    steps = (Step.of(passing),)
    extensions, least_further = _beside(search, steps, singles, {n: c.gain for n, c in singles.items()})
    return State(steps, extensions, least_further, singles, {**search.least_gain, passing.name: PASSING_GAIN})


def _worth_adding(state: State) -> dict[str, Candidate]:
    """Candidates that gain enough beside the last step; beside MOST_DEVIATIONS those alone that would be named."""
    enough = {n: c for n, c in state.extensions.items() if c.gain - state.gain >= state.least_further_gain[n]}
    if state.deviations >= MOST_DEVIATIONS:  # a random effect that another leaves may be one more
        enough = {n: c for n, c in enough.items() if c.evidence >= FIRST_GAIN}
    return enough


def _best_of(judged: Mapping[str, Candidate], before: float) -> Candidate | None:
    """The best of the candidates that were fitted in full; None where there is none.

    Likelihoods of real flights are too sure of themselves (TEMPERATURE). So of two that gain nearly as much the one is
    better whose strength is the rarer in nominal flights. A deviation that nominal flights have as well is added before
    an effect with evidence only where it gains more by a share MISFIT_SHARE_DEVIATION, as no model is exact.

    before: nats that the last step gains over no effect.
    """
    full = [c for c in judged.values() if c.full]

    def merit(candidate: Candidate) -> float:
        return candidate.gain / TEMPERATURE + min(candidate.evidence, CERTAIN)

    best = max(full, key=merit, default=None)
    if best is None or best.evidence >= FIRST_GAIN:
        return best
    least = before + (1.0 - MISFIT_SHARE_DEVIATION) * (best.gain - before)
    as_good = [c for c in full if c.evidence >= FIRST_GAIN and c.gain >= least]
    return max(as_good, key=merit, default=best)


def _added(search: Search, state: State, best: Candidate) -> State:
    """The state with a further step: named, or a deviation where its evidence or its gain is too small for a name."""
    singles = state.singles
    if not state.named:  # what nominal flights have as well stands beside every candidate
        added = {s.name for s in state.steps}
        singles = {**singles, **{n: c for n, c in state.extensions.items() if n not in added}}
    left_by_another = bool(state.named) and is_random_misfit(search.trial, state.steps[-1], best)
    steps = (*state.steps, Step.of(best, named=best.evidence >= FIRST_GAIN and not left_by_another))
    after = replace(state, steps=steps, singles=singles)
    if len(after.named) >= MOST_EFFECTS:  # nothing is added to these
        return after
    further_gains = {n: c.gain - state.gain for n, c in state.extensions.items()}
    extensions, least_further = _beside(search, steps, state.extensions, further_gains)
    return replace(after, extensions=extensions, least_further_gain=least_further)


def _beside(search: Search, steps: Sequence[Step], before: Mapping[str, Candidate], further_gains: Mapping[str, float],
            ) -> tuple[dict[str, Candidate], dict[str, float]]:
    """Candidates judged beside the steps so far, and the nats that each must gain.

    before: candidates as judged before the newest step; further_gains: nats that each of them gained over the steps
    then. Beside a deviation of nominal flights only those are judged again that gained something without it, as a
    deviation takes gain from others and seldom adds any.
    """
    trial, named = search.trial, any(s.named for s in steps)
    gained = {n for n, gain in further_gains.items() if gain > WORTH_AGAIN * FIRST_GAIN}
    worth = {n: v for n, v in search.candidates.items() if named or n in gained}
    sure = {n for n, c in before.items() if c.full and c.evidence >= SURE_EVIDENCE and not is_random(n)}
    extensions = round_of(trial, worth, steps[-1], search.progress, promising=sure)
    return extensions, {n: least_further_gain(trial, steps[-1], c) if named else trial.policy.first_gain
                        for n, c in extensions.items()}
