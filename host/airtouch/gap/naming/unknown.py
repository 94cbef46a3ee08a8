"""What speaks against the effects named, and when that makes the answer `unknown`.

Two things speak against them, each held against a limit of its own: what they leave, which the nameless model gains
beside them (where the relations of signals decide, what these measure), and what they predict that the flights do not
show (`over_prediction`). The flights are explained where the larger of the two ratios to the limits is below 1. The
limits: `policy.UnknownLimit`.
"""

import numpy as np

from airtouch.gap.evidence.against import Against
from airtouch.gap.naming.records import Selection


def against(selection: Selection) -> Against:
    """Nats that speak against the effects named, with those that may where they are right.

    By the relations of signals where these decide, else the gain of the nameless model beside the effects.
    """
    if selection.inference is not None:
        return selection.inference.against
    gain = selection.last_step.gain if selection.last_step else 0.0
    limit = selection.policy.unknown.nats(gain, selection.nameless.over_none, selection.assumed)
    return Against(selection.nameless.over_last_step, limit, of_distance=False)


def over_prediction_ratio(selection: Selection) -> float:
    """Nats of over-prediction over those that may be chance."""
    nats = selection.over_prediction.nats
    return nats / selection.policy.unknown.least if nats else 0.0


def remainder_ratio(selection: Selection) -> float:
    """Nats of what the effects named leave over their limit."""
    remainder = against(selection)
    never_negative = float(np.logaddexp(remainder.nats, 0.0))  # softplus: the nats where these are many, else above 0
    return never_negative / remainder.limit


def against_over_limit(selection: Selection) -> float:
    """How much speaks against the effects named over its limit: what they leave, or over-prediction."""
    return max(remainder_ratio(selection), over_prediction_ratio(selection))


def is_explained(selection: Selection) -> bool:
    """Whether what is left is the floor, or close to it, and the effects named do not over-predict."""
    return against_over_limit(selection) < 1.0
