"""The parameters of a named effect with their errors: from the spectra or the logged times, and from a reading.

Parameters are scaled (`signatures.term`): 0 is neutral, 1 a natural step. The 90 % interval of each is made of its
variance (`Term.quantities`), which is the sum of

1. that of the fit: the likelihood's curvature;
2. the square of half the difference of the two halves of the data: what one half shows and the other does not;
3. the square of the model's error, a fraction of the parameter (`model_error`);
4. where an effect that delays what the controllers see gains by the echo of noise: that of a row of the log
   (`ROW_VARIANCE_S2`).

An effect that shows in the logged times alone has the variance of their chance instead (`from_times`).

On white noise of the expected power, intervals of the first alone would hold 88 %, as the likelihood's tails and the
overlap of its blocks make it a little too sure; those of the first two hold 94 % (`tests/gap/answer/test_estimates.py`
derives and checks both). Real flights scatter beyond that noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from airtouch.gap.evidence.clock import CORRELATION_S, nominal_time_rms_s
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import FittedTerms
from airtouch.gap.evidence.problem import whole_of
from airtouch.gap.evidence.random_strength import strength_variance
from airtouch.gap.evidence.sensing import sensing_gain
from airtouch.gap.flights.clock import LEAST_JITTER_S
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.loop.closed_loop import ClosedLoop
from airtouch.gap.relations.readout import Reading
from airtouch.gap.signatures.signature import MEAN, SPECTRUM
from airtouch.gap.signatures.term import Term

#: fraction of a parameter by which the replay may be wrong: strong effects in eight simulated flights came out up to
#: 0.26 % off, rms 0.14 % (`python tools/simulation/replay_error.py`)
REPLAY_ERROR = 0.002
#: fraction of a parameter by which the model of a random effect's spectrum may be wrong; chosen. A larger number makes
#: the intervals wider
SPECTRUM_ERROR = 0.1
#: fraction of a parameter by which the loop's model may be wrong: replayed inertia and late sensors lay 27 and 29 %
#: off, the median of nine flights of two opened sealed sets
LOOP_ERROR = 0.25
#: variance, s^2, of a delay of which the echo of noise says that it is there: it may be any within a row of the log.
#: In seven simulated flights (five of RotorPy, seeds 0 and 1, two of `hover`) the spectra alone were up to 4 ms off
ROW_VARIANCE_S2 = PERIOD_S ** 2 / 12.0


class Estimate(NamedTuple):
    """Scaled parameters (k,) of an effect, and their covariance (k, k)."""

    x: np.ndarray
    covariance: np.ndarray


def from_spectra(data: Data, term: Term, fitted: FittedTerms, halves: Sequence[FittedTerms]) -> Estimate:
    """The estimate of an effect that shows in the spectra.

    term: one of `fitted`, which is fitted to all the data; halves: fits of the same effects to each half, or none.
    """
    if term.shows_in == MEAN:
        place = fitted.slice_of(term)
        x, covariance = fitted.scaled[place], fitted.covariance[place, place]
    else:
        x, covariance = term.scaled(term.values), strength_variance(data, whole_of(data), fitted.terms, term)
    of_halves = [t.scaled(t.values) for f in halves for t in f.terms if t.slot == term.slot]
    apart = 0.5 * (of_halves[0] - of_halves[1]) if len(of_halves) == 2 else np.zeros(len(x))
    error = model_error(data.study.loop, term) * term.scaled(term.values)
    of_row = ROW_VARIANCE_S2 / np.square([term.step(p) for p in term.free]) if sensing_gain(data, [term]) else 0.0
    return Estimate(x, covariance + np.diag(apart ** 2 + error ** 2 + of_row))


def model_error(loop: ClosedLoop | None, term: Term) -> float:
    """Fraction of its parameters by which the model of an effect may be wrong; its own scatter at least."""
    error = REPLAY_ERROR
    if loop is not None and loop.changes_loop((term.active(),)):
        error = LOOP_ERROR
    elif term.shows_in == SPECTRUM:
        error = SPECTRUM_ERROR
    return max(error, term.signature.own_scatter)


def from_times(data: Data, term: Term) -> Estimate:
    """The estimate of an effect that shows in the logged times alone, its values being the measured ones.

    The relative variance of a standard deviation m from n independent values is 1 / (2 n); the clock has one such value
    in CORRELATION_S. A jitter is what m has beyond the nominal one, s^2 = m^2 - nominal^2, so that its relative
    variance is (m / s)^4 times that.

    The relative variance of a number of lost samples is E[L^2] / (E[L] times the number), where runs begin as in a
    Poisson process and have L samples (compound Poisson); of geometric lengths of mean b it is (2 b - 1) / the number.
    No relative variance is more than 1.
    """
    samples = sum(len(f) for f in data.flights)
    if term.signature.loss_runs is not None:
        lost_fraction, length = (term.values[p] for p in term.signature.loss_runs)
        inverse = lost_fraction * samples / (2.0 * length - 1.0)  # of the relative variance
    else:
        independent, (jitter_s,) = samples / (CORRELATION_S / PERIOD_S), (term.values[p] for p in term.free)
        inverse = 2.0 * independent / (1.0 + (nominal_time_rms_s(data.study) / max(jitter_s, LEAST_JITTER_S)) ** 2) ** 2
    x = term.scaled(term.values)
    return Estimate(x, np.diag(x ** 2 / max(inverse, 1.0)))


def with_reading(term: Term, estimate: Estimate, reading: Mapping[str, Reading]) -> Estimate:
    """An estimate by the replay and by the relations of signals together; unchanged without a reading.

    reading: by parameter.

    Both are weighted by precision (the update of a Kalman filter), so that parameters that the replay knows as a sum or
    a product move together. Where the two differ by more than their errors, chi^2 of k parameters above k, the
    covariance grows by chi^2 / k (Birge 1932).
    """
    x, covariance = estimate
    read = [i for i, name in enumerate(term.free) if name in reading]
    if not read:
        return estimate
    measured = replace(term, free=tuple(term.free[i] for i in read))
    value = measured.scaled({name: reading[name].value for name in measured.free})
    variance = np.diag([(reading[name].deviation / term.step(name)) ** 2 for name in measured.free])
    precision = np.linalg.inv(covariance[np.ix_(read, read)] + variance)
    gain, apart = covariance[:, read] @ precision, value - x[read]
    wider = max(1.0, float(apart @ precision @ apart) / len(read))
    low, high = term.bounds()
    return Estimate(np.clip(x + gain @ apart, low, high), wider * (covariance - gain @ covariance[read]))
