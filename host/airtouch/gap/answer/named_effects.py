"""The effects named: fitted to all the data, in the shape that gains most, with 90 % intervals."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from airtouch.gap.evidence.clock import CORRELATION_S
from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import SETTLED, FittedTerms, fit, judge, strength_variance
from airtouch.gap.evidence.problem import BlockSet, whole_of
from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.loop.closed_loop import ClosedLoop
from airtouch.gap.naming.judging import at_bound
from airtouch.gap.naming.records import Candidate, Selection
from airtouch.gap.relations.readout import Reading
from airtouch.gap.result import NamedEffect
from airtouch.gap.signatures.candidates import term_of
from airtouch.gap.signatures.signature import CLOCK, MEAN, SPECTRUM
from airtouch.gap.signatures.term import Term

SHAPE_PRICE = 1.0  #: nats that another shape of an effect must gain on all the data; chosen
RESTARTS = 12  #: of a fit of several parameters, at most
#: fraction of a parameter by which the replay may be wrong: strong effects in eight simulated flights came out up to
#: 0.26 % off, rms 0.14 % (`python tools/simulation/replay_error.py`)
REPLAY_ERROR = 0.002
#: fraction of a parameter by which the model of the loop or of a random effect's spectrum may be wrong; chosen
MODEL_ERROR = 0.1
#: fraction of an effect's only parameter by which the loop's model may be wrong, where the relations of signals measure
#: it too: replayed inertia and late sensors lay 27 and 29 % off, the median of nine flights of two opened sealed sets
LOOP_ERROR = 0.25


def named_effects(data: Data, selection: Selection) -> list[NamedEffect]:
    """The effects that a selection names, fitted anew to all the data, with 90 % intervals.

    Their order is that of the selection, so that the first is the first of the ranking.
    """
    hypothesis, named = selection.last_step, selection.named_hypothesis
    if hypothesis is None or named is None:
        return []
    readings = selection.inference.readings if selection.inference is not None else {}
    in_spectra = [t for t in hypothesis.terms if t.shows_in != CLOCK]
    fitted = best_shape(data, whole_of(data), in_spectra, _mean_of_halves(hypothesis))
    shown = [t for t in fitted.terms if t.slot in selection.named_slots]
    effects = [_named(t, *_in_spectra(data, hypothesis, fitted, t, readings), readings)
               for t in shown if not t.companion]
    for part in (t for t in shown if t.companion and t.shows_in == SPECTRUM):
        effects = [with_random_part(e, part) for e in effects]
    effects += [_named(t, *_in_times(data, t), readings) for t in named.terms if t.shows_in == CLOCK]
    order = [s.name for s in selection.named_steps]
    return sorted(effects, key=lambda e: order.index(e.name))


def at_end_of_range(effects: Sequence[NamedEffect]) -> list[str]:
    """A note on each fitted parameter that lies at the end of its range, where the model stretches."""
    notes = []
    for effect in effects:
        term = term_of(effect)
        ends = at_bound(term, term.among_all(term.scaled(term.values)))
        notes += [f"{effect.name}: {name} is at the end of its range ({effect.parameters[name].value:.4g}): the true"
                  " one lies beyond it, or something else is behind the gap"
                  for name, end in zip(term.signature.free, ends, strict=True) if end]
    return notes


def _named(term: Term, x: np.ndarray, covariance: np.ndarray, readings: Mapping[str, Reading]) -> NamedEffect:
    """An effect with scaled parameters x (k,) and covariance (k, k), and with its reading where there is one."""
    fitted = with_reading(term, x, covariance, readings.get(term.name, {}))
    return NamedEffect(term.name, term.quantities(*fitted), term.gate)


def _in_spectra(data: Data, hypothesis: Candidate, fitted: FittedTerms, term: Term, readings: Mapping[str, Reading],
                ) -> tuple[np.ndarray, np.ndarray]:
    """Scaled parameters (k,) of an effect that shows in the spectra, and their covariance (k, k).

    The covariance is that of the likelihood, of the difference of the two halves, and of model errors.
    """
    if term.shows_in == MEAN:
        place = fitted.place(term)
        x, covariance = fitted.scaled[place], fitted.covariance[place, place]
    else:
        x, covariance = term.scaled(term.values), strength_variance(data, whole_of(data), fitted.terms, term)
    of_halves = [t.scaled(t.values) for f in hypothesis.fits for t in f.terms if t.slot == term.slot]
    apart = 0.5 * (of_halves[0] - of_halves[1]) if len(of_halves) == 2 else np.zeros(len(x))
    error = _model_error(data.study.loop, term, term.name in readings and len(x) == 1)
    return x, covariance + np.diag(apart ** 2) + np.diag((error * term.scaled(term.values)) ** 2)


def _model_error(loop: ClosedLoop | None, term: Term, read: bool) -> float:
    """Fraction of its parameters by which the model of an effect may be wrong.

    read: whether the relations of signals measure its only parameter too.
    """
    error = REPLAY_ERROR
    if loop is not None and loop.changes_loop((term.active(),)):
        error = LOOP_ERROR if read else MODEL_ERROR
    elif term.shows_in == SPECTRUM:
        error = MODEL_ERROR
    return max(error, term.signature.own_scatter)


def _in_times(data: Data, term: Term) -> tuple[np.ndarray, np.ndarray]:
    """Scaled strength (1,) of an effect of the logged times, and its variance (1, 1).

    A jitter's is that of a standard deviation estimated from one sample in CORRELATION_S; that of an effect counted in
    bursts is the variance of a Poisson number of bursts.
    """
    samples = sum(len(f) for f in data.flights)
    independent = samples / (CORRELATION_S / PERIOD_S)
    count = 2.0 * independent  # a standard deviation from n values has the relative variance 1 / (2 n)
    if term.signature.loss_runs is not None:
        share, burst = (term.values[p] for p in term.signature.loss_runs)
        count = share * samples / (2.0 * burst - 1.0)
    x = term.scaled(term.values)
    return x, np.diag(x ** 2 / max(count, 1.0))


def best_shape(data: Data, all_blocks: BlockSet, terms: Sequence[Term], start: np.ndarray | None) -> FittedTerms:
    """Effects fitted to all the data, in the shape that gains most.

    start: scaled parameters from which the fit begins. A shape other than that of the terms must gain SHAPE_PRICE.
    """
    best = fit(data, all_blocks, terms, start)
    for i, term in enumerate(terms):
        level = judge(data, all_blocks, best.terms) + SHAPE_PRICE
        for shaped in term.shaped():
            trial = fit(data, all_blocks, [*terms[:i], shaped, *terms[i + 1:]], start)
            gain = judge(data, all_blocks, trial.terms)
            if gain > level:
                best, level = trial, gain
    return converged(data, all_blocks, best)


def converged(data: Data, all_blocks: BlockSet, best: FittedTerms) -> FittedTerms:
    """The fit, begun anew where it ended until that gains nothing.

    Parameters that trade against each other, as a battery's charge and capacity, lie along a bent valley, which one fit
    leaves off half way: strengths of seven simulated batteries came out up to a third too small.
    """
    level = judge(data, all_blocks, best.terms)
    for _ in range(RESTARTS if len(best.scaled) > 1 else 0):
        again = fit(data, all_blocks, best.terms, best.scaled)
        reached = judge(data, all_blocks, again.terms)
        if reached > level:
            best = again
        if reached < level + SETTLED:
            break
        level = reached
    return best


def with_random_part(effect: NamedEffect, part: Term) -> NamedEffect:
    """The effect with its random part as fitted, so that a simulator can switch it on unchanged.

    The part was fitted at its own strength (1, of the published curve), while the effect has one strength for
    mean and random part: the part's parameters are divided by it. A mean too weak to carry them within their
    bounds is raised to the least that does.
    """
    if effect.name != part.name:
        return effect
    (amount,) = part.signature.free  # the strength
    own, of_mean = part.values[amount], effect.parameters[amount]
    limits = {p.name: p.high for p in part.effect.parameters}
    strength = max(of_mean.value, *(own * part.values[k] / limits[k] for k in part.free), 1e-6)
    raised = replace(of_mean, value=strength, high=strength if of_mean.high is None else max(of_mean.high, strength))
    scaled = {k: replace(effect.parameters[k], value=own * part.values[k] / strength) for k in part.free}
    return NamedEffect(effect.name, {**effect.parameters, amount: raised, **scaled}, effect.seconds)


def with_reading(term: Term, x: np.ndarray, covariance: np.ndarray, reading: Reading) -> tuple[np.ndarray, np.ndarray]:
    """Scaled parameters (k,) and covariance (k, k) of an effect, by its replay and by the relations of signals.

    Both are weighted by precision (the update of a Kalman filter), so that parameters that the replay knows as a sum or
    a product move together. Where the two differ by more than their errors, the covariance grows by that factor
    squared (Birge 1932).
    """
    read = [i for i, name in enumerate(term.free) if name in reading]
    if not read:
        return x, covariance
    measured = replace(term, free=tuple(term.free[i] for i in read))
    value = measured.scaled({name: reading[name][0] for name in measured.free})
    variance = np.diag([(reading[name][1] / term.step(name)) ** 2 for name in measured.free])
    precision = np.linalg.inv(covariance[np.ix_(read, read)] + variance)
    gain, apart = covariance[:, read] @ precision, value - x[read]
    wider = max(1.0, float(apart @ precision @ apart) / len(read))
    low, high = term.bounds()
    return np.clip(x + gain @ apart, low, high), wider * (covariance - gain @ covariance[read])


def _mean_of_halves(hypothesis: Candidate) -> np.ndarray | None:
    """Mean of the scaled parameters that the two halves of the data gave, None where none is free."""
    scaled = [f.scaled for f in hypothesis.fits]
    return np.mean(scaled, axis=0) if scaled and len(scaled[0]) else None
