"""The effects named: fitted to all the data, in the shape that gains most, with 90 % intervals."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from airtouch.gap.evidence.data import Data
from airtouch.gap.evidence.fit import SETTLED, Fit, fit, judge, strength_variance
from airtouch.gap.evidence.problem import Part, whole_of
from airtouch.gap.loop.closed_loop import ClosedLoop
from airtouch.gap.naming.selection import Judged, Selection
from airtouch.gap.relations.readout import Reading
from airtouch.gap.result import Found
from airtouch.gap.signatures.signature import CLOCK, MEAN, SPECTRUM
from airtouch.gap.signatures.term import Term

SHAPE_PRICE = 1.0  #: nats that another shape of an effect must gain on all the data; chosen
RESTARTS = 12  #: of a fit of several parameters, at most
#: fraction of a parameter by which the model of the loop or of a random effect's spectrum may be wrong; chosen
MODEL_ERROR = 0.1
#: fraction of an effect's only parameter by which the loop's model may be wrong, where the relations of signals measure
#: it too: replayed inertia and late sensors lay 27 and 29 % off, the median of nine flights of two opened sealed sets
LOOP_ERROR = 0.25


def chosen_effects(data: Data, selection: Selection) -> list[Found]:
    """The effects that the selection chose, fitted anew to all the data, with 90 % intervals.

    Their order is that of the selection, so that the first is the first of the ranking.
    """
    judged = selection.whole
    if selection.chosen is None or judged is None:
        return []
    replayed = [t for t in judged.terms if t.kind != CLOCK]
    whole = whole_of(data)
    fitted = (best_shape(data, whole, replayed, _mean_of_halves(judged)) if replayed
              else Fit((), np.zeros(0), np.zeros((0, 0)), np.zeros(0), 0.0))
    chosen = {t.name for t in selection.chosen.terms}
    readings = selection.inference.readings if selection.inference is not None else {}
    out, first = [], 0
    for t in fitted.terms:
        part = slice(first, first + len(t.free)) if t.kind == MEAN else None
        if part is not None:
            first += len(t.free)
        if t.name not in chosen:
            continue
        if t.companion:
            out = [with_random_part(e, t) for e in out]
            continue
        x = fitted.scaled[part] if part is not None else t.scaled(t.values)
        covariance = (fitted.covariance[part, part] if part is not None
                      else strength_variance(data, whole, fitted.terms, t))
        spread = _spread(data.study.controller, judged, t, covariance,
                         LOOP_ERROR if t.name in readings and len(t.free) == 1 else MODEL_ERROR)
        out.append(Found(t.name, t.quantities(*with_reading(t, x, spread, readings.get(t.name, {}))), t.gate))
    for t in (t for t in selection.chosen.terms if t.kind == CLOCK):
        spread = _of_clock(t, sum(len(f) for f in data.flights))
        out.append(Found(t.name, t.quantities(*with_reading(t, t.scaled(t.values), spread, readings.get(t.name, {})))))
    order = {s.name: i for i, s in reversed(list(enumerate(selection.named)))}
    return sorted(out, key=lambda e: order.get(e.name, len(order)))


def best_shape(data: Data, whole: Part, terms: Sequence[Term], start: np.ndarray | None) -> Fit:
    """Effects fitted to all the data, in the shape that gains most.

    start: scaled parameters from which the fit begins. A shape other than that of the terms must gain SHAPE_PRICE.
    """
    best = fit(data, whole, terms, start)
    for i, term in enumerate(terms):
        level = judge(data, whole, best.terms) + SHAPE_PRICE
        for shaped in term.shaped():
            trial = fit(data, whole, [*terms[:i], shaped, *terms[i + 1:]], start)
            gain = judge(data, whole, trial.terms)
            if gain > level:
                best, level = trial, gain
    return converged(data, whole, best)


def converged(data: Data, whole: Part, best: Fit) -> Fit:
    """The fit, begun anew where it ended until that gains nothing.

    Parameters that trade against each other, as a battery's charge and capacity, lie along a bent valley, which one fit
    leaves off half way: strengths of seven simulated batteries came out up to a third too small.
    """
    level = judge(data, whole, best.terms)
    for _ in range(RESTARTS if len(best.scaled) > 1 else 0):
        again = fit(data, whole, best.terms, best.scaled)
        reached = judge(data, whole, again.terms)
        if reached > level:
            best = again
        if reached < level + SETTLED:
            break
        level = reached
    return best


def with_random_part(effect: Found, part: Term) -> Found:
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
    return Found(effect.name, {**effect.parameters, amount: raised, **scaled}, effect.seconds)


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


def _mean_of_halves(chosen: Judged) -> np.ndarray | None:
    """Mean of the scaled parameters that the two halves of the data gave, None where none is free."""
    scaled = [f.scaled for f in chosen.fits]
    return np.mean(scaled, axis=0) if scaled and len(scaled[0]) else None


def _of_clock(term: Term, samples: int) -> np.ndarray:
    """Variance (1, 1) of the scaled strength of an effect of the logged times, from so many samples.

    A jitter's is that of a standard deviation estimated from a tenth of the samples; that of an effect counted in
    bursts is the variance of a Poisson number of bursts.
    """
    count = 2.0 * samples / 10.0
    bursts = term.signature.bursts
    if bursts is not None:
        share, burst = (term.values[p] for p in bursts)
        count = share * samples / (2.0 * burst - 1.0)
    return np.diag(term.scaled(term.values) ** 2 / max(count, 1.0))


def _spread(law: ClosedLoop | None, chosen: Judged, term: Term, covariance: np.ndarray, of_loop: float) -> np.ndarray:
    """Covariance of a term's scaled parameters: of the likelihood, of the two halves' difference and of model errors.

    of_loop: fraction of a parameter by which the model of the loop may be wrong.
    """
    pairs = [t.scaled(t.values) for f in chosen.fits for t in f.terms
             if t.identity == term.identity]
    between = np.zeros((len(term.free), len(term.free)))
    if len(pairs) == 2:
        between = np.diag((0.5 * (pairs[0] - pairs[1])) ** 2)
    loop = law is not None and law.changes_loop((term.active(),))
    error = max(of_loop if loop else MODEL_ERROR if term.kind == SPECTRUM else 0.0,
                term.signature.own_scatter)
    return covariance + between + np.diag((error * term.scaled(term.values)) ** 2)
