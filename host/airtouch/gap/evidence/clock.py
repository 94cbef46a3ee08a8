"""Effects on the logged times alone: how far the clock and the losses are from nominal flights'."""

from collections.abc import Sequence

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.signatures.candidates import Term

LEAST_CLOCK_S = 2e-4  #: rms of a clock that nothing disturbs
JITTER, LOSS = "time_jitter", "packet_loss"


def jitter(data: Data) -> tuple[float, float]:
    """Rms (s) that is added to the usual one of the logged times, and the log likelihood that it gains."""
    usual = max(data.study.floor.clock_s, LEAST_CLOCK_S)
    clock = np.concatenate([f.clock_s for f in data.flights])
    now = max(float(np.std(clock)), 1e-9)
    if now <= usual:
        return 0.0, 0.0
    n = len(clock) * PERIOD_S / 0.1  # arrival times hang together for a tenth of a second
    return float(np.sqrt(now ** 2 - usual ** 2)), float(
        0.5 * n * ((now / usual) ** 2 - 1.0 - 2.0 * np.log(now / usual)))


def loss(data: Data) -> tuple[float, float]:
    """Share of the samples that was lost, and the log likelihood that it gains over the usual share."""
    lost = np.concatenate([f.lost for f in data.flights]).astype(float)
    share, usual = float(lost.mean()), max(data.study.floor.lost, 1e-3 if data.study.controller is None else 3e-4)
    if share <= usual:
        return share, 0.0
    n = len(lost) / 2.0
    there = (1.0 - share) * np.log((1.0 - share) / (1.0 - usual))
    return share, float(n * (share * np.log(share / usual) + there))


def clock_gain(data: Data, term: Term) -> tuple[Term, float]:
    """An effect on the logged times with its parameter as measured, and its gain."""
    found, gain = jitter(data) if term.name == JITTER else loss(data)
    return term.fitted(np.array([found / term.step(term.free[0])])), gain


def clock_left(data: Data, named: Sequence[str]) -> float:
    """Log likelihood that the logged times hold beyond the effects named."""
    return (0.0 if JITTER in named else jitter(data)[1]) + (0.0 if LOSS in named else loss(data)[1])
