"""The probability of each candidate, of `none` and of `unknown`."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.naming.policy import TEMPERATURE
from airtouch.gap.naming.records import Selection
from airtouch.gap.naming.unknown import against_over_limit

#: nats that others lie behind the effect that is named first, at least; chosen, so that it leads the list
LEAST_LEAD = 1.0
#: lowest score of a candidate with enough evidence: odds 1/e against `none`; chosen: more than one of three or more
#: candidates without enough evidence can have, 1/n of n
LEAST_SCORE = -TEMPERATURE
#: of the probability of the answer, that of `unknown` at most where `unknown` is not the answer; chosen, as LEAST_LEAD
MOST_UNKNOWN = 0.9


def probabilities(selection: Selection, answer: str) -> dict[str, float]:
    """The probability of every single candidate, of `none` and of `unknown`; they sum to 1, the answer's is largest.

    answer: the first effect named, else the verdict (`ranking.verdict_of`).

    `unknown` has one half where as much speaks against the effects as may, and odds that grow with its square. Every
    other candidate has a weight by its evidence alone. The verdict knows more than these weights: that the gap is at
    its floor, in which seconds a passing effect acts, which effects act together. So an answer other than `unknown`
    weighs as much as the heaviest other candidate at least, and limits `unknown` (MOST_UNKNOWN).
    """
    names = [*selection.single_effects, "none"]
    weight = dict(zip(names, _weights(selection), strict=True))
    if answer != "unknown":
        weight[answer] = max(weight.get(answer, 0.0), *weight.values())
    total = np.array([*weight.values()]).sum()
    odds = against_over_limit(selection) ** 2
    if answer != "unknown":
        odds = min(odds, MOST_UNKNOWN * (weight[answer] / total))
    unknown = odds / (1.0 + odds)
    return {n: (1.0 - unknown) * w / total for n, w in weight.items()} | {"unknown": unknown}


def _weights(selection: Selection) -> np.ndarray:
    """Weight (k + 1,) of each of k single candidates, in their order, and of `none`, beside one another."""
    names = list(selection.single_effects)
    if selection.inference is not None:
        alone = selection.inference.probabilities()
        return np.array([alone[n] for n in (*names, "none")])
    score = np.array([*_scores(selection, names), 0.0])
    return np.exp((score - score.max()) / TEMPERATURE)


def _scores(selection: Selection, names: Sequence[str]) -> list[float]:
    """Score of every single candidate beside 0 for `none`, nats.

    Those with the evidence that they need keep the order of their gains: the first effect named leads them by
    LEAST_LEAD at least, and none has less than LEAST_SCORE.
    """
    single_effects = selection.single_effects
    out = [_beside_none(single_effects[n].evidence, selection.least_nats[n], len(names)) for n in names]
    if not selection.named_steps or selection.named_steps[0].name not in names:
        return out
    first = names.index(selection.named_steps[0].name)
    leads = [max(single_effects[names[first]].gain - single_effects[n].gain, LEAST_LEAD) for n in names]
    return [max(out[first] - leads[i], LEAST_SCORE) if score >= 0.0 and i != first else score
            for i, score in enumerate(out)]


def _beside_none(evidence: float, least: float, many: int) -> float:
    """Score of one of many candidates beside 0 for `none`, nats: what is missing counts in full, what is over little.

    evidence: nats over `none` and over what nominal flights show; least: nats that are needed. What is missing is
    multiplied by TEMPERATURE, by which every score is divided: such a candidate has the odds e^(evidence - least) /
    many. What is over is divided by it, as the likelihoods of real flights are too sure of themselves.
    """
    if evidence < least:
        return TEMPERATURE * (evidence - least - np.log(many))
    return evidence - least
