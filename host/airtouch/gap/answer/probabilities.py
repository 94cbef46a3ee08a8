"""The probability of each candidate, of `none` and of `unknown`."""

import numpy as np

from airtouch.gap.naming.policy import TEMPERATURE
from airtouch.gap.naming.records import Selection
from airtouch.gap.naming.unknown import against_over_limit

#: nats by which the effect named first leads every other candidate at least; chosen, so that it leads the list. A
#: larger number makes the answer look more certain than its evidence
LEAST_LEAD = 1.0
#: nats, lowest score of a candidate with the evidence that it needs: odds of 1/e against `none`; chosen: of n
#: candidates without that evidence each has odds of 1/n at most, which is less where n is three or more
LEAST_SCORE = -TEMPERATURE
#: largest ratio of the probability of `unknown` to that of an answer other than `unknown`; chosen, so that the answer
#: leads the list. A larger number makes the two look equally likely
MOST_UNKNOWN = 0.9


def probabilities(selection: Selection, answer: str) -> dict[str, float]:
    """The probability of every single candidate, of `none` and of `unknown`: no other is larger than the answer's.

    answer: the first effect named, else the verdict (`ranking.verdict_of`).

    `unknown` has one half where as much speaks against the effects as may, and odds that grow with its square. What it
    does not have is shared among the candidates and `none` by their weights, which come from evidence alone. The
    verdict knows more than these weights: that the gap is at its floor, in which seconds a passing effect acts, which
    effects act together. So an answer other than `unknown` weighs at least as much as the heaviest of the others, and
    `unknown` stays below it (MOST_UNKNOWN).
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
    """Weights (k + 1,) of the k single candidates, in their order, and of `none`; only their ratios mean something."""
    names = list(selection.single_effects)
    if selection.inference is not None:
        alone = selection.inference.probabilities()
        return np.array([alone[n] for n in (*names, "none")])
    score = np.array([*(_score(selection, n) for n in names), 0.0])
    return np.exp((score - score.max()) / TEMPERATURE)


def _score(selection: Selection, name: str) -> float:
    """Score of a single candidate, nats; that of `none` is 0.

    A candidate with the evidence that it needs stands behind the effect named first by as much as it gains less, by
    LEAST_LEAD at least, and not below LEAST_SCORE. The effect named first itself, a candidate without that evidence,
    and every candidate where none is named have the score of their evidence (`_score_of_evidence`).
    """
    single_effects, needed = selection.single_effects, selection.least_nats
    first = selection.named_steps[0].name if selection.named_steps else None
    if first is None or first not in single_effects or name == first or single_effects[name].evidence < needed[name]:
        return _score_of_evidence(selection, name)
    behind = max(single_effects[first].gain - single_effects[name].gain, LEAST_LEAD)
    return max(_score_of_evidence(selection, first) - behind, LEAST_SCORE)


def _score_of_evidence(selection: Selection, name: str) -> float:
    """Score of a single candidate by its evidence over that needed, nats; that of `none` is 0.

    Scores are divided by TEMPERATURE before they become weights, as the likelihoods of real flights are too sure of
    themselves. Evidence that is missing is not trusted less for that, so it is multiplied by TEMPERATURE beforehand: of
    n candidates each that lacks evidence has the odds e^(evidence - needed) / n against `none`.
    """
    over = selection.single_effects[name].evidence - selection.least_nats[name]
    return over if over >= 0.0 else TEMPERATURE * (over - np.log(len(selection.single_effects)))
