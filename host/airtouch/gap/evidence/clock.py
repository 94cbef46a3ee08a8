"""Effects on the logged times alone: how far jitter and lost rows exceed those of nominal flights."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.flights.clock import LEAST_JITTER_S
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.signatures.signature import CLOCK
from airtouch.gap.signatures.term import Term
from airtouch.gap.study import Study

#: least fraction of lost samples that nominal flights are taken to have, without a model of the loop and with one; both
#: chosen, as a few flights may have lost none. A larger number overlooks small losses
LEAST_LOSS, LEAST_LOSS_WITH_LOOP = 1e-3, 3e-4
#: samples that count as one independent value of being lost; chosen, as losses come in runs. A larger number gives a
#: loss less evidence
SAMPLES_OF_ONE = 2.0
CORRELATION_S = 0.1  #: s over which arrival times are correlated; chosen. A larger number gives a jitter less evidence


class TimesFault(NamedTuple):
    """Size of a fault of the logged times, and the log likelihood, nats, that it gains over the nominal size.

    size: s of jitter, or fraction of lost samples.
    """

    size: float
    gain: float


def nominal_time_rms_s(study: Study) -> float:
    """Rms, s, of the logged times minus regular ones in nominal flights; their mean is not removed.

    It is LEAST_JITTER_S at least.
    """
    return max(study.floor.clock_s, LEAST_JITTER_S)


def jitter(data: Data) -> TimesFault:
    """Jitter of the logged times.

    Its size s is the standard deviation of the times beyond the rms of nominal ones: s^2 = deviation^2 - rms^2.
    The deviation is about the mean, the rms about 0: a constant offset of the flights' times is no jitter.

    The gain is that of normal times with this deviation, over normal times with the nominal rms: of n independent
    values n/2 (r - 1 - log r), where r is the ratio of the variances.
    """
    nominal_rms_s = nominal_time_rms_s(data.study)
    times = np.concatenate([f.clock_s for f in data.flights])
    deviation_s = float(np.std(times))
    if deviation_s <= nominal_rms_s:
        return TimesFault(0.0, 0.0)
    n = len(times) * PERIOD_S / CORRELATION_S
    gain = 0.5 * n * ((deviation_s / nominal_rms_s) ** 2 - 1.0 - 2.0 * np.log(deviation_s / nominal_rms_s))
    return TimesFault(float(np.sqrt(deviation_s ** 2 - nominal_rms_s ** 2)), float(gain))


def loss(data: Data) -> TimesFault:
    """Loss of rows: its size is the fraction of lost samples.

    The gain is that of samples each lost with the measured fraction, over the nominal one (binomial).
    """
    missing = np.concatenate([f.lost for f in data.flights]).astype(float)
    least = LEAST_LOSS if data.study.loop is None else LEAST_LOSS_WITH_LOOP
    fraction, nominal = float(missing.mean()), max(data.study.floor.lost, least)
    if fraction <= nominal:
        return TimesFault(fraction, 0.0)
    n = len(missing) / SAMPLES_OF_ONE
    arrived = (1.0 - fraction) * np.log((1.0 - fraction) / (1.0 - nominal))
    return TimesFault(fraction, float(n * (fraction * np.log(fraction / nominal) + arrived)))


class MeasuredTerm(NamedTuple):
    """An effect on the logged times with its parameter as measured, and its gain over nominal times, nats."""

    term: Term
    gain: float


def measured_clock_term(data: Data, term: Term) -> MeasuredTerm:
    """The effect with the size of the fault that it stands for: of lost rows or of jitter."""
    fault = loss(data) if term.signature.loses_rows else jitter(data)
    return MeasuredTerm(term.fitted(np.array([fault.size / term.step(term.free[0])])), fault.gain)


def clock_gains(data: Data, terms: Sequence[Term]) -> float:
    """Nats that those terms gain together which act on the logged times."""
    return sum(measured_clock_term(data, t).gain for t in terms if t.shows_in == CLOCK)


def unexplained_clock_gain(data: Data, terms: Sequence[Term]) -> float:
    """Nats that jitter and lost rows gain over nominal ones, without those of the faults that effects explain."""
    of_times = [t for t in terms if t.shows_in == CLOCK]
    loss_explained = any(t.signature.loses_rows for t in of_times)
    jitter_explained = any(not t.signature.loses_rows for t in of_times)
    return (0.0 if jitter_explained else jitter(data).gain) + (0.0 if loss_explained else loss(data).gain)
