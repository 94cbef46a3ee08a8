"""From the logits of `best` to edges, causal."""

from dataclasses import dataclass

import numpy as np

from airtouch.errors import AirTouchError

#: The logits that the decoder reads, the first columns; kernel_types.h has their number for C.
LOGITS = ("over", "entry", "exit")
#: largest magnitude of a logit, a probability of 0.9997: one wild logit moves the smoothed one no further
LOGIT_LIMIT = 8.0
SMOOTHED_AT_START = -3.0  #: smoothed over logit before anything is known: over a platform with a probability of 0.05
MOST_LOOK_BACK = 63  #: steps, the largest `look_back`: one less than EDGE_DECODER_RING in edge_decoder.h
MOST_STEPS = 2**32 - 1  #: of the other three counts, uint32_t in decoderConfig_t
LONG_AGO = 0x3FFFFFFF  #: steps since an edge that never was


@dataclass(frozen=True)
class DecoderConfig:
    """Settings; scores are logits, steps those of the network.

    An entry fires where entry logit + over_share * over logit > entry_score, an exit where
    exit logit - over_share * over logit > exit_score; or late, where the over logit smoothed
    by smooth_gain a step passes late_entry upwards or late_exit downwards. The crossing is taken to be where
    the event's logit peaked within look_back steps before (or while the edge waits); the edge is reported
    hold_steps after it, at once where that has passed. Raises AirTouchError for a count of steps that is no whole
    number from 0 to MOST_STEPS, for look_back to MOST_LOOK_BACK.
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

    def __post_init__(self) -> None:
        for name in ("dwell_steps", "arm_steps", "look_back", "hold_steps"):
            steps, most = getattr(self, name), MOST_LOOK_BACK if name == "look_back" else MOST_STEPS
            whole = isinstance(steps, (int, np.integer)) and not isinstance(steps, bool)
            if not (whole and 0 <= steps <= most):
                raise AirTouchError(f"edge decoder: {name} is {steps!r}, not a whole number from 0 to {most}")


@dataclass(slots=True)
class _State:
    """What the decoder remembers from step to step while the drone flies; `edgeDecoder_t` in C."""

    airborne_steps: int = 0  #: without a break
    smoothed_over: float = SMOOTHED_AT_START
    over: bool = False  #: over a platform
    since: int = LONG_AGO  #: steps since the last edge
    waiting: int = 0  #: kind of the edge that waits to be reported: 0 none, 1 entry, 2 exit
    due: int = 0  #: steps until it is reported
    peak: float = 0.0  #: its logit at the crossing


def edge_decoder(logits: np.ndarray, airborne: np.ndarray, config: DecoderConfig = DecoderConfig()) -> np.ndarray:
    """Edges (n,), 0 none, 1 entry, 2 exit, of logits (n, 3 or more): over, entry, exit; airborne (n,) bool.

    NaN logits count as "no". On the ground the state is off the platform, and forgotten.
    Raises AirTouchError when the shapes disagree.
    """
    check_shapes(np.shape(logits), np.shape(airborne))
    limited = np.clip(np.where(np.isnan(logits), -LOGIT_LIMIT, logits), -LOGIT_LIMIT, LOGIT_LIMIT)
    edges = np.zeros(len(limited), dtype=np.uint8)
    state = _State()
    for t, (over_logit, *event_logits) in enumerate(limited):
        if not airborne[t]:
            state = _State()
            continue
        state.airborne_steps += 1
        state.smoothed_over += config.smooth_gain * (over_logit - state.smoothed_over)
        state.since = min(state.since + 1, LONG_AGO)
        if state.waiting:
            _wait(state, event_logits[state.waiting - 1], config)
        ready = state.airborne_steps >= config.arm_steps and state.since >= config.dwell_steps
        event = int(state.over)  # column of the event that can come next
        if ready and _fires(state, over_logit, event_logits[event], config):
            edges[t] = state.waiting  # an edge that still waits is not held up by the next one
            first = t + 1 - min(state.airborne_steps, config.look_back + 1)
            recent = limited[first:t + 1, 1 + event][::-1]
            steps_ago = int(np.argmax(recent))
            state.peak, state.due = recent[steps_ago], max(config.hold_steps - steps_ago, 0)
            state.over, state.waiting = not state.over, event + 1
            state.since, state.smoothed_over = 0, 0.0
        if not edges[t] and state.waiting and state.due == 0:
            edges[t], state.waiting = state.waiting, 0
    return edges


def check_shapes(logits: tuple[int, ...], airborne: tuple[int, ...]) -> None:
    """Raises AirTouchError unless logits are (n, 3 or more) and airborne is (n,)."""
    if len(logits) != 2 or logits[1] < len(LOGITS) or airborne != logits[:1]:
        raise AirTouchError(f"edge decoder: needs logits (n, {len(LOGITS)}) and airborne (n,), "
                            f"not {logits}, {airborne}")


def _wait(state: _State, logit: float, config: DecoderConfig) -> None:
    """Move the edge that waits to a higher peak of its event's logit, or a step nearer to its report."""
    if logit > state.peak:
        state.peak, state.due = logit, config.hold_steps
    else:
        state.due = max(state.due - 1, 0)


def _fires(state: _State, over_logit: float, event_logit: float, config: DecoderConfig) -> bool:
    """Whether an edge is seen: by its own logit beside the over logit, or late by the smoothed one."""
    support = config.over_share * over_logit
    if state.over:
        return event_logit - support > config.exit_score or state.smoothed_over < config.late_exit
    return event_logit + support > config.entry_score or state.smoothed_over > config.late_entry
