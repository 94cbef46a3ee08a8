"""The probability of each candidate, of `none` and of `unknown`."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.naming.policy import TEMPERATURE
from airtouch.gap.naming.records import Selection
from airtouch.gap.naming.unknown import against_over_limit, is_explained

LEAD = 1.0  #: nats that others lie behind the effect that is the answer, at least; chosen, so that it leads the list
#: of the probability of the answer, that of `unknown` at most where `unknown` is not the answer; chosen, as LEAD
MOST_UNKNOWN = 0.9


def probabilities(selection: Selection, is_none: bool = False) -> dict[str, float]:
    """The probability of every single candidate, of `none` and of `unknown`; they sum to 1.

    is_none: whether the verdict is `none`, which it is for a gap at its floor even where the selection names effects
    (`ranking.verdict_of`).

    `unknown` has one half where as much speaks against the effects as may, and odds that grow with its square. Where an
    effect or `none` is the answer it stays below that.
    """
    names = list(selection.single_effects)
    weight = _weights(selection, names)
    total = weight.sum()
    odds = against_over_limit(selection) ** 2
    unknown = odds / (1.0 + odds)
    if selection.named_hypothesis is not None and is_explained(selection):
        unknown = _limited(unknown, weight[names.index(selection.named_steps[0].name)] / total)
    if is_none:
        unknown = _limited(unknown, weight[-1] / total)
    known = (1.0 - unknown) * weight / total
    return dict(zip([*names, "none", "unknown"], [*known, unknown], strict=True))


def _limited(unknown: float, share: float) -> float:
    """Probability of `unknown`, MOST_UNKNOWN that of an answer at most, which has this share of all others."""
    return min(unknown, MOST_UNKNOWN * share / (1.0 + MOST_UNKNOWN * share))


def _weights(selection: Selection, names: Sequence[str]) -> np.ndarray:
    """Weight (k + 1,) of each of k candidates, and of `none`, beside one another."""
    if selection.inference is not None:
        alone = selection.inference.probabilities()
        return np.array([alone[n] for n in (*names, "none")])
    score = np.array([*_scores(selection, names), 0.0])
    return np.exp((score - score.max()) / TEMPERATURE)


def _scores(selection: Selection, names: Sequence[str]) -> list[float]:
    """Score of every single candidate beside 0 for `none`, nats; those that could be named keep the order of gains.

    The first effect named leads them by LEAD at least.
    """
    single_effects = selection.single_effects
    out = [_against_none(single_effects[n].evidence, selection.least_nats[n], len(names)) for n in names]
    if not selection.named_steps or selection.named_steps[0].name not in names:
        return out
    first = names.index(selection.named_steps[0].name)

    def beside_first(i: int) -> float:
        """Score of a candidate that could be named, or of the first effect itself."""
        behind = max(single_effects[names[first]].gain - single_effects[names[i]].gain, LEAD) if i != first else 0.0
        return max(out[first] - behind, -TEMPERATURE)

    return [beside_first(i) if score >= 0.0 else score for i, score in enumerate(out)]


def _against_none(gain: float, least: float, many: int = 1) -> float:
    """Score of one of many candidates beside 0 for `none`: what is missing counts in full, what is over little.

    gain: the evidence, nats, over `none` and over what nominal flights show; least: what is needed.
    """
    if gain < least:
        return TEMPERATURE * (gain - least - np.log(many))
    return gain - least
