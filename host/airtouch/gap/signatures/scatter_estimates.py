"""The scatter of nominal flights estimated from flights: of a class for the table, of a baseline given the table."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import poch

from airtouch.gap.signatures.alike import ALIKE
from airtouch.gap.signatures.candidates import is_random
from airtouch.gap.signatures.posterior import LEAST, mean_and_deviation, predicted, standard_deviation, updated
from airtouch.gap.signatures.scatter import LEAST_SPREAD, UNSTEADY, ApparentStrengths, Scatter, fourth_root, table
from airtouch.gap.signatures.signature import SIGNATURES

LEAST_RECORDED = 0.02  #: scatter at least, in natural steps, in recorded flights, which chance at times explains wholly
RECORDED_WORTH = 4.0  #: flights that a class of recorded ones counts as at most, beside the baseline's own; chosen
#: flights that the level of how unsteady a class of recorded ones is counts as, beside the baseline's own; chosen: it
#: predicts 89 nominal flights of the build part from their baselines, 1 and 4 hardly worse (host/docs/looks.md)
LEVEL_WORTH = 2.0
POOLED = 1.0  #: flights that the scatter of all an effect's parameters together counts as, for each of them; chosen
LEAST_RATE_SPREAD = 0.3  #: standard deviation at least of a rate's fourth root, where classes are compared; chosen
RATE_FREEDOM = 4.0  #: degrees of freedom of Student's density of that root: a flight or two may be odd; chosen
SIMULATED = "simulated"  #: the class of flights of this project's simulator that are all drawn with one trim
OWN_TRIM = "simulated, trim of its own"  #: of those whose rotors and battery are drawn anew for each, as real ones are
Pair = tuple[float, float]  #: mean and standard deviation


def scatter_of(baseline: Sequence[ApparentStrengths], recorded: bool = False, vehicle: str = "",
               one_trim: bool | None = None, calibrated_on: int = 0) -> Scatter:
    """The scatter of the vehicle's class, or else of the one that the baseline flights fit best, updated by them.

    baseline: flights compared with a vehicle that was calibrated on all of them, and on others: on `calibrated_on` = n
    together, by default on these alone. Their variance is widened by (n + 1) / (n - 1): each was among those that it
    is compared with, another flight will not be.
    recorded: the logs' format says that a drone has flown them, so no class of simulated flights is theirs. A class
    that was measured on the vehicle of this name leaves no room for other vehicles'. one_trim: whether the baseline's
    trims are alike, which tells the classes of simulated flights apart; None: nobody knows. One flight or none says
    nothing: the scatter is then the widest of any class.
    """
    classes = _possible_classes(recorded, vehicle, one_trim)
    n = len(baseline)
    known = tuple(baseline) if n > 1 else ()
    if n < 2:
        own, widening, simulated = _widest(list(classes.values())), 1.0, False
    else:
        together = max(n, calibrated_on)
        widening = (together + 1.0) / (together - 1.0)
        likelihood = {name: _log_likelihood(c, known, widening) for name, c in classes.items()}
        best = max(likelihood, key=likelihood.__getitem__)
        own, simulated = classes[best], best == SIMULATED  # whose flights are all drawn alike
    worth = own.freedom if simulated else min(own.freedom, RECORDED_WORTH)
    update = Update(own, known, worth)
    means = _updated_means(update)
    least = LEAST if simulated else LEAST_RECORDED
    rms = _updated_rms(update, means, math.sqrt(widening), least) | _of_hidden(update)
    level_worth = worth if simulated else min(worth, LEVEL_WORTH)
    sizes = {n: updated(r, _sizes(known, n), worth, r[1]) for n, r in own.passing.items() if n not in UNSTEADY}
    levels = {n: predicted(own.passing[n], _sizes(known, n), level_worth, worth) for n in UNSTEADY if n in own.passing}
    passing = _air_as_one(sizes) | levels
    rate = updated(own.rate, fourth_root([f.rate for f in known]), worth)
    return Scatter(_alike_as_one(rms), worth + len(known), rate, passing, middle=means, exact=simulated)


def class_scatter(flights: Sequence[ApparentStrengths], alike: Sequence[ApparentStrengths] | None = None) -> Scatter:
    """The scatter of flights each of which was compared with others than itself.

    alike: those of them that give the rates and the degrees of freedom, which were compared with flights of their own
    day and condition; all by default.
    """
    alike = flights if alike is None else alike
    rms, means = {}, {}
    for name in sorted({n for f in flights for n in f.strengths}):
        rows = [f for f in flights if name in f.strengths]
        size = max(len(f.strengths[name]) for f in rows)
        columns = [(_column(rows, name, "strengths", k), _column(rows, name, "errors", k)) for k in range(size)]
        if is_random(name):
            means[name] = np.array([strengths.mean() for strengths, _ in columns])
            columns = [(strengths - m, errors) for (strengths, errors), m in zip(columns, means[name], strict=True)]
        together, errors = (np.concatenate(part) for part in zip(*columns, strict=True))
        pooled = standard_deviation(together, errors, 0.0)
        rms[name] = np.array([standard_deviation(x, e, pooled, (POOLED,)) for x, e in columns] if size > 1
                             else [pooled])
    # of passing effects the largest count in full: a nominal flight may have met a gust, and the next may too
    names = sorted({n for f in alike for n in f.passing})
    passing = {n: mean_and_deviation(_sizes(alike, n)) for n in names}
    rate = mean_and_deviation(fourth_root([f.rate for f in alike]))
    return Scatter(rms, float(len(alike)), rate, passing, middle=means)


def _possible_classes(recorded: bool, vehicle: str, one_trim: bool | None) -> dict[str, Scatter]:
    """The classes of the table that the flights of a vehicle may be of; see `scatter_of`."""
    not_theirs = {SIMULATED, OWN_TRIM} if recorded else {True: {OWN_TRIM}, False: {SIMULATED}, None: set()}[one_trim]
    classes = {name: c for name, c in table().items() if name not in not_theirs}
    of_vehicle = {name: c for name, c in classes.items() if c.vehicle == vehicle}
    return of_vehicle if vehicle and of_vehicle else classes


class Update(NamedTuple):
    """A class's scatter, which counts as `worth` flights, and the flights of the baseline by which it is updated."""

    own: Scatter
    known: Sequence[ApparentStrengths]
    worth: float


def _updated_means(update: Update) -> dict[str, np.ndarray]:
    """Mean strength (k,) of each random effect, of the class and of the baseline."""
    means, (own, known, worth) = {}, update
    for name in own.rms:
        if name in own.middle:
            rows = [f for f in known if name in f.strengths]
            sums = sum((f.strengths[name] for f in rows), worth * own.middle[name])
            means[name] = sums / (worth + len(rows))
    return means


def _updated_rms(update: Update, means: Mapping[str, np.ndarray], widening: float, least: float,
                 ) -> dict[str, np.ndarray]:
    """Scatter (k,) of each effect's strength about its mean, by the baseline's flights, at least `least`.

    widening: factor of the baseline's scatter. The log's times are known exactly and differ from day to day: their
    scatter is not less than the class's.
    """
    rms, (own, known, worth) = {}, update
    for name, prior in own.rms.items():
        rows = [f for f in known if name in f.strengths]
        centre = means.get(name, np.zeros(len(prior)))
        own_rms = [standard_deviation(widening * (_column(rows, name, "strengths", k) - centre[k]),
                                      widening * _column(rows, name, "errors", k), p,
                                      (worth, min(worth, RECORDED_WORTH)))
                   for k, p in enumerate(prior)] if rows else prior
        exact = rows and not any(f.errors[name].any() for f in rows)
        rms[name] = np.maximum(own_rms, np.maximum(prior, least) if exact else least)
    return rms


def _of_hidden(update: Update) -> dict[str, np.ndarray]:
    """Scatter (k,) of the effects that no flight of the baseline could show: none, so that chance alone counts.

    The class's is that of flights which could: the authors' nominal ones have the ground effect of their platforms, 0.1
    to 0.3 of the published curve. A baseline high above the ground says nothing of it, and what a flight near the
    ground has of it is news.
    """
    class_rms, known = update.own.rms, update.known
    hidden = frozenset.intersection(*(f.hidden for f in known)) if known else frozenset()
    return {name: np.full(len(class_rms[name]), LEAST) for name in sorted(hidden) if name in class_rms}


def _alike_as_one(rms: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Scatter by effect, in which names of one thing in the logs, as mass and thrust, have the wider of theirs.

    Those of several parameters keep their own: these are not the same one by one.
    """
    out = dict(rms)
    for confusion in ALIKE:
        same = [out[n] for n in confusion.effects if n in out]
        if {len(x) for x in same} == {1}:
            out |= {n: np.max(same, axis=0) for n in confusion.effects if n in out}
    return out


def _air_as_one(sizes: Mapping[str, Pair]) -> dict[str, Pair]:
    """Sizes of passing effects, in which effects with one companion have those that reach highest.

    Moving air has drag beside it, whether it is steady or gusts: what nominal flights have of the one may be the other
    in the next flight. Of a wind alone most have none at all, and a few much, which no mean and deviation describe.
    """
    out = dict(sizes)
    for companion in {SIGNATURES[n].companion for n in sizes if n in SIGNATURES} - {""}:
        same = [n for n in sizes if n in SIGNATURES and SIGNATURES[n].companion == companion]
        out |= dict.fromkeys(same, _highest(sizes[n] for n in same))
    return out


def _highest(pairs: Iterable[Pair]) -> Pair:
    """The pair that reaches highest: mean and one standard deviation."""
    return max(pairs, key=lambda pair: pair[0] + pair[1])


def _column(flights: Sequence[ApparentStrengths], name: str, what: str, k: int) -> np.ndarray:
    """Parameter k of an effect, "strengths" or "errors", in every flight that has it (n,)."""
    return np.array([getattr(f, what)[name][k] for f in flights if k < len(f.strengths[name])])


def _sizes(flights: Sequence[ApparentStrengths], name: str) -> list[float]:
    """Sizes by a name of `ApparentStrengths.passing`, of the flights of which it is known."""
    return [f.passing[name] for f in flights if name in f.passing]


def _log_likelihood(own: Scatter, baseline: Sequence[ApparentStrengths], wide: float) -> float:
    """Log likelihood of the baseline's strengths, rates and sizes in a class; wide: factor of their variance."""
    total, nu = 0.0, own.freedom
    for flight in baseline:
        for name, rms in own.rms.items():
            if name in flight.strengths:
                n = min(len(rms), len(flight.strengths[name]))
                variance = np.maximum(rms[:n], LEAST_SPREAD) ** 2 + wide * flight.errors[name][:n] ** 2
                strength = flight.strengths[name][:n] - own.middle.get(name, np.zeros(n))[:n]
                far = wide * strength ** 2 / variance
                total -= float(np.sum(0.5 * np.log(variance) + 0.5 * (nu + 1.0) * np.log1p(far / nu)))
        mean, spread = own.rate
        spread = max(spread, LEAST_RATE_SPREAD)
        total += float(student_log_density(fourth_root(flight.rate), RATE_FREEDOM, mean, spread))
        for name, (mean, spread) in own.passing.items():
            for size in _sizes([flight], name):
                total += float(student_log_density(size, RATE_FREEDOM, mean, max(spread, LEAST_SPREAD)))
    return total


def student_log_density(x: float, freedom: float, mean: float, spread: float) -> float:
    """Logarithm of Student's density about a mean, of a spread; scipy.stats takes a second to import."""
    far = (x - mean) / spread
    top = np.log(poch(0.5 * freedom, 0.5)) - 0.5 * (np.log(freedom) + np.log(np.pi))
    return top - 0.5 * (freedom + 1.0) * np.log1p(far * far / freedom) - np.log(spread)


def _widest(classes: Sequence[Scatter]) -> Scatter:
    """Of every effect the widest scatter of any class: for vehicles of which no nominal flight is known.

    About no strength: what a random effect has on average in flights of a class (`middle`) is left out.
    """
    names = {n for c in classes for n in c.rms}
    rms = {n: np.max([c.rms[n] for c in classes if n in c.rms], axis=0) for n in sorted(names)}

    passing = {n: _highest(c.passing[n] for c in classes if n in c.passing)
               for n in sorted({n for c in classes for n in c.passing})}
    return Scatter(rms, min(c.freedom for c in classes), _highest(c.rate for c in classes), passing)
