"""What speaks against the effects named, and when that makes the answer `unknown`.

Three things speak against them, each held against a limit of its own:

1. what they leave, which the nameless model gains beside them; where the relations of signals decide, what these
   measure. Its limit: `policy.UnknownLimit`;
2. what they predict that the flights do not show (`over_prediction`), with the least of these limits;
3. that the flights are less steady than nominal ones (`passing.unsteadiness`). Noise that is equally strong all along
   does not explain that, nor does an error of the logged times. Its limit is what one nominal flight in a hundred
   exceeds.

The flights are explained where the largest of the ratios to the limits is below 1.
"""

import numpy as np

from airtouch.gap.evidence.counterevidence import Counterevidence
from airtouch.gap.naming.records import Selection
from airtouch.gap.signatures.signature import MEAN


def counterevidence(selection: Selection) -> Counterevidence:
    """Nats that speak against the effects named, with those that may where they are right.

    By the relations of signals where these decide, else the gain of the nameless model beside the effects.
    """
    if selection.inference is not None:
        return selection.inference.counterevidence
    gain = selection.last_step.gain if selection.last_step else 0.0
    limit = selection.policy.unknown.nats(gain, selection.nameless.over_none, selection.spectrum_is_assumed)
    return Counterevidence(selection.nameless.over_last_step, limit, of_distance=False)


def over_prediction_ratio(selection: Selection) -> float:
    """Nats of over-prediction over those that may be chance."""
    nats = selection.over_prediction.nats
    return nats / selection.policy.unknown.least if nats else 0.0


def remainder_ratio(selection: Selection) -> float:
    """Nats of what the effects named leave over their limit."""
    remainder = counterevidence(selection)
    never_negative = float(np.logaddexp(remainder.nats, 0.0))  # softplus: the nats where these are many, else above 0
    return never_negative / remainder.limit


def unsteadiness_ratio(selection: Selection) -> float:
    """Nats by which the flights are less steady than nominal ones over their limit.

    It is 0 where an effect is named that may explain it: any but noise that is equally strong all along, and errors of
    the logged times alone.
    """
    hypothesis = selection.named_hypothesis
    if hypothesis is not None and any(t.shows_in == MEAN or t.gate for t in hypothesis.terms):
        return 0.0
    return selection.unsteadiness_rarity.nats / selection.unsteadiness_rarity.limit


def against_over_limit(selection: Selection) -> float:
    """The most that speaks against the effects named, over its limit."""
    return max(remainder_ratio(selection), over_prediction_ratio(selection), unsteadiness_ratio(selection))


def is_explained(selection: Selection) -> bool:
    """Whether nothing speaks against the effects named by more than may be chance."""
    return against_over_limit(selection) < 1.0
