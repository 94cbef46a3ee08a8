"""From the logits of `best` to edges, causal."""

from dataclasses import dataclass

import numpy as np

#: The logits that the decoder reads, the first columns; kernel_types.h has their number for C.
LOGITS = ("over", "entry", "exit")
#: largest magnitude of a logit, a probability of 0.9997: one wild logit moves the smoothed one no further
LOGIT_LIMIT = 8.0
SLOW_AT_START = -3.0  #: the smoothed over logit before anything is known: over a platform with a probability of 0.05
LONG_AGO = 0x3FFFFFFF  #: steps since an edge that never was


@dataclass(frozen=True)
class DecoderConfig:
    """Settings; scores are logits, steps those of the network.

    An entry fires where entry logit + over_share * over logit > entry_score, an exit where
    exit logit - over_share * over logit > exit_score; or late, where the over logit smoothed
    by smooth_gain a step passes late_entry upwards or late_exit downwards. The crossing is taken to be where
    the event's logit peaked within look_back steps before (or while the edge waits); the edge is reported
    hold_steps after it, at once where that has passed.
    """

    over_share: float = 0.5
    entry_score: float = 0.0
    exit_score: float = 0.0
    late_entry: float = 2.0
    late_exit: float = -2.0
    smooth_gain: float = 0.1
    dwell_steps: int = 20
    arm_steps: int = 100
    look_back: int = 50
    hold_steps: int = 0


def edge_decoder(logits: np.ndarray, airborne: np.ndarray, config: DecoderConfig = DecoderConfig()) -> np.ndarray:
    """Edges (n,), 0 none, 1 entry, 2 exit, of logits (n, 3 or more): over, entry, exit; airborne (n,) bool.

    NaN logits count as "no". On the ground the state is off the platform, and forgotten.
    """
    limited = np.clip(np.where(np.isnan(logits), -LOGIT_LIMIT, logits), -LOGIT_LIMIT, LOGIT_LIMIT)
    edges = np.zeros(len(limited), dtype=np.uint8)
    start, waiting, due, peak, over, slow, since = 0, 0, 0, 0.0, False, SLOW_AT_START, LONG_AGO
    for t, (p, *events) in enumerate(limited):
        if not airborne[t]:
            start, waiting, over, slow, since = t + 1, 0, False, SLOW_AT_START, LONG_AGO
            continue
        slow += config.smooth_gain * (p - slow)
        since = min(since + 1, LONG_AGO)
        if waiting and events[waiting - 1] > peak:
            peak, due = events[waiting - 1], config.hold_steps
        elif waiting:
            due = max(due - 1, 0)
        free = t + 1 - start >= config.arm_steps and since >= config.dwell_steps
        if free and _fires(p, events[int(over)], slow, over, config):
            edges[t] = waiting
            recent = limited[max(t - config.look_back, start):t + 1, 1 + int(over)][::-1]
            back = int(np.argmax(recent))
            peak, due = recent[back], max(config.hold_steps - back, 0)
            over, since, slow = not over, 0, 0.0
            waiting = 1 if over else 2
        if not edges[t] and waiting and due == 0:
            edges[t], waiting = waiting, 0
    return edges


def _fires(p: float, event: float, slow: float, over: bool, config: DecoderConfig) -> bool:
    """Whether an edge is seen: by its own logit beside the over logit, or late by the smoothed one."""
    if over:
        return event - config.over_share * p > config.exit_score or slow < config.late_exit
    return event + config.over_share * p > config.entry_score or slow > config.late_entry
