"""From the streaming network's three logits to edges, causal."""

from dataclasses import dataclass

import numpy as np

LOGIT_LIMIT = 8.0  #: logits are clamped to this magnitude
SLOW_AT_START = -3.0  #: the smoothed over logit before anything is known: off a platform
LONG_AGO = 0x3FFFFFFF  #: steps since an edge that never was


@dataclass(frozen=True)
class DecoderConfig:
    """Settings; scores are logits, steps those of the network.

    An entry fires where entry logit + over_share * over logit > entry_score, an exit where
    exit logit - over_share * over logit > exit_score; or late, where the over logit smoothed
    by smooth_gain a step passes late_entry upwards or late_exit downwards.
    """

    over_share: float = 0.5
    entry_score: float = 0.0
    exit_score: float = 0.0
    late_entry: float = 2.0
    late_exit: float = -2.0
    smooth_gain: float = 0.1
    dwell_steps: int = 20
    arm_steps: int = 100


def edge_decoder(logits: np.ndarray, airborne: np.ndarray, config: DecoderConfig = DecoderConfig()) -> np.ndarray:
    """Edges (n,), 0 none, 1 entry, 2 exit, of logits (n, 3): over, entry, exit; airborne (n,) bool.

    NaN logits count as "no". On the ground the state is off the platform, and forgotten.
    """
    limited = np.clip(np.where(np.isnan(logits), -LOGIT_LIMIT, logits), -LOGIT_LIMIT, LOGIT_LIMIT)
    edges = np.zeros(len(limited), dtype=np.uint8)
    slow, since, flown, over = SLOW_AT_START, LONG_AGO, 0, False
    for t, (p, entry, leave) in enumerate(limited):
        if not airborne[t]:
            slow, since, flown, over = SLOW_AT_START, LONG_AGO, 0, False
            continue
        flown += 1
        slow += config.smooth_gain * (p - slow)
        since = min(since + 1, LONG_AGO)
        if flown < config.arm_steps or since < config.dwell_steps:
            continue
        if over:
            fires = leave - config.over_share * p > config.exit_score or slow < config.late_exit
        else:
            fires = entry + config.over_share * p > config.entry_score or slow > config.late_entry
        if fires:
            over, since, slow = not over, 0, 0.0
            edges[t] = 1 if over else 2
    return edges
