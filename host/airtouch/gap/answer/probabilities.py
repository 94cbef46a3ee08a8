"""The probability of each candidate, of `none` and of `unknown`.

The weight of a candidate is e^(score / TEMPERATURE), where the score is in nats and that of `none` is 0.

1. A candidate that lacks evidence has the score TEMPERATURE (evidence - needed - ln n), n being the number of
   candidates: together they have odds of 1 at most against `none`.
2. A candidate with the evidence that it needs has the score evidence - needed.
3. A candidate that has this evidence beside the effect named first stands behind it by as much as it gains less, by
   LEAST_LEAD at least, but its score is not below LEAST_SCORE.
4. An answer other than `unknown` weighs at least as much as the heaviest candidate. The verdict knows more than
   evidence: that the gap is at its floor, in which seconds a passing effect acts, which effects act together.
5. The odds of `unknown` are the square of what speaks against the effects named over its limit: one half where as much
   does as may. The others have what is left, in proportion to their weights.
6. Beside another answer the probability of `unknown` is at most MOST_UNKNOWN times the answer's.

Where the relations of signals decide, the weights are their probabilities (`Inference.probabilities`) in place of
rules 1 to 3.
"""

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
    """The probability of every single candidate, of `none` and of `unknown`; no other is larger than the answer's.

    answer: the first effect named, else the verdict (`ranking.verdict_of`).
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
    """Score of a single candidate, nats: rule 3, else rules 1 and 2."""
    single_effects, needed = selection.single_effects, selection.least_nats
    first = selection.named_steps[0].name if selection.named_steps else None
    if first is None or first not in single_effects or name == first or single_effects[name].evidence < needed[name]:
        return _score_of_evidence(selection, name)
    behind = max(single_effects[first].gain - single_effects[name].gain, LEAST_LEAD)
    return max(_score_of_evidence(selection, first) - behind, LEAST_SCORE)


def _score_of_evidence(selection: Selection, name: str) -> float:
    """Score of a single candidate by its evidence alone, nats: rules 1 and 2.

    TEMPERATURE divides scores because the likelihoods of real flights are too sure of themselves. Evidence that is
    missing is no less certain for that, so rule 1 multiplies by TEMPERATURE beforehand.
    """
    over = selection.single_effects[name].evidence - selection.least_nats[name]
    return over if over >= 0.0 else TEMPERATURE * (over - np.log(len(selection.single_effects)))
