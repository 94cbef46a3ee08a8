"""Classifier two-sample test of simulated against recorded flights: AUROC by phase, 0.5 if they are alike.

Features of windows of one second (levels, slopes, band powers, correlations) are classified by gradient boosting,
and scored on held-out flights. Source: Lopez-Paz, Oquab, Revisiting Classifier Two-Sample Tests, 2017.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.twin.recorded import channels as ch
from airtouch.twin.recorded.channels import NAMES
from airtouch.twin.recorded.course import PHASES, Course
from airtouch.twin.recorded.features import PAIRS

WINDOW, HOP = 100, 50  #: samples of a window, and from one to the next; no source: 1 s, half of it
#: bands of a window's powers, Hz; no source: about octaves, from what a window resolves to half of the rate
BANDS_HZ = ((0.5, 2.5), (2.5, 5), (5, 9), (9, 15), (15, 25), (25, 50))
CHANNELS = ch.DOWN  #: number of channels that the classifier gets: all except the down range, which no detector gets
FOLDS = 5  #: folds of the cross-validation over flights; no source: the usual number
BINS = 255  #: bins of each feature, scikit-learn's maximum
RESAMPLES = 500  #: bootstrap samples; no source: round number, for time
CONFIDENCE = 0.95  #: probability of the intervals, by bootstrap over flights
MIN_FLIGHTS = 4  #: least number of flights of each kind in a phase; no source: round number
#: settings of the gradient boosting: small trees, as windows are few; no source: round numbers
BOOSTING = {"max_iter": 80, "learning_rate": 0.1, "max_leaf_nodes": 12, "min_samples_leaf": 10,
            "l2_regularization": 1.0, "class_weight": "balanced", "early_stopping": False}
LISTED = 3  #: features named in `Auroc.telling`


@dataclass(frozen=True)
class Auroc:
    """AUROC of a phase on held-out flights, its interval by flight, and sample sizes."""

    phase: str
    value: float
    low: float
    high: float
    real_flights: int
    simulated_flights: int
    windows: int
    telling: tuple[str, ...]  #: the features that separate best, from the best


@dataclass(frozen=True)
class Windows:
    """Features of windows: values (windows, features), with phase (windows,) and flight (windows,), both numbers.

    The same flight number in a real and a simulated set means the same course: both are held out together.
    """

    values: np.ndarray
    phase: np.ndarray
    flight: np.ndarray


def feature_names() -> list[str]:
    """Names of a window's features."""
    out = []
    for name in NAMES[:CHANNELS]:
        out += [f"{name} level", f"{name} slope"] + [f"{name} {a:g}-{b:g} Hz" for a, b in BANDS_HZ]
    return out + [f"correlation {NAMES[i]}, {NAMES[k]}" for i, k in PAIRS]


def windows(flights: Sequence[tuple[np.ndarray, Course, int]]) -> Windows:
    """Windows of flights, each given as (channels (n, 12), course, flight number).

    Levels are relative to the median in the flight's own free air, so that trims do not count.
    """
    values, phases, flight_numbers = [], [], []
    for x, course, number in flights:
        x = x[:, :CHANNELS] - np.median(x[course.free, :CHANNELS], axis=0)
        for p, name in enumerate(PHASES):
            span = course.phases()[name]
            for start in range(span.start, min(span.stop, len(x)) - WINDOW + 1, HOP):
                values.append(_features(x[start:start + WINDOW]))
                phases.append(p)
                flight_numbers.append(number)
    return Windows(np.array(values).reshape(-1, len(feature_names())), np.array(phases), np.array(flight_numbers))


def _features(x: np.ndarray) -> np.ndarray:
    """The features (features,) of one window (WINDOW, CHANNELS), in the order of `feature_names`."""
    t = np.linspace(-1.0, 1.0, len(x))
    level = x.mean(axis=0)
    slope = t @ x / (t @ t)
    residual = x - level - t[:, None] * slope
    power = np.abs(np.fft.rfft(residual * np.hanning(len(x))[:, None], axis=0)) ** 2
    f = np.fft.rfftfreq(len(x), 1.0 / SAMPLE_RATE_HZ)
    bands = [np.log(power[(f >= a) & (f < b)].mean(axis=0) + 1e-9) for a, b in BANDS_HZ]
    size = np.sqrt((residual * residual).sum(axis=0)) + 1e-9
    pairs = [(residual[:, i] @ residual[:, k]) / (size[i] * size[k]) for i, k in PAIRS]
    return np.r_[np.column_stack([level, slope, *bands]).ravel(), pairs]


def two_sample(real: Windows, simulated: Windows, seed: int = 0,
               progress: Callable[[str], None] = lambda _: None) -> list[Auroc]:
    """AUROC of each phase in which both sets have MIN_FLIGHTS flights. The same arguments give the same result.

    progress: as progress(phase). Raises AirTouchError without scikit-learn.
    """
    results = []
    for p, name in enumerate(PHASES):
        a, b = real.phase == p, simulated.phase == p
        if min(len(np.unique(real.flight[a])), len(np.unique(simulated.flight[b]))) < MIN_FLIGHTS:
            continue
        progress(name)
        x = np.vstack([real.values[a], simulated.values[b]])
        kind = np.r_[np.zeros(a.sum(), int), np.ones(b.sum(), int)]
        flight = np.r_[real.flight[a], simulated.flight[b]]
        score, fold, best_features = _out_of_fold(x, kind, flight, seed)
        low, high = _interval(score, kind, flight, fold, seed)
        results.append(Auroc(name, area_within(score, kind, fold), low, high, len(np.unique(real.flight[a])),
                             len(np.unique(simulated.flight[b])), len(x), best_features))
    return results


def area(score: np.ndarray, kind: np.ndarray) -> float:
    """Area under the ROC curve: fraction of (1, 0) pairs in which the 1 scores higher; ties count half.

    score: (n,). kind: (n,), 0 or 1. Source: the Mann-Whitney statistic (Hanley, McNeil, Radiology 143, 1982).
    """
    order = np.sort(score[kind == 0])
    ones = score[kind == 1]
    below = np.searchsorted(order, ones, "left") + np.searchsorted(order, ones, "right")
    return float(below.mean() / (2.0 * len(order)))


def area_within(score: np.ndarray, kind: np.ndarray, fold: np.ndarray) -> float:
    """`area` over pairs within a fold (n,), as scores of different models cannot be compared; NaN without pairs."""
    pairs, total = 0.0, 0.0
    for k in np.unique(fold):
        mask = fold == k
        count = float(kind[mask].sum()) * float((1 - kind[mask]).sum())
        if count:
            pairs, total = pairs + count, total + count * area(score[mask], kind[mask])
    return total / pairs if pairs else float("nan")


def _boosting(seed: int) -> Any:
    """The classifier, not fitted yet. Raises AirTouchError without scikit-learn."""
    try:
        from sklearn.ensemble import HistGradientBoostingClassifier
    except ImportError:
        raise AirTouchError("the two-sample test needs scikit-learn: pip install 'airtouch[train]'") from None
    return HistGradientBoostingClassifier(**BOOSTING, random_state=seed)


def _bin(train: np.ndarray, x: np.ndarray) -> np.ndarray:
    """x (rows, features) in BINS bins of each feature's distribution in `train`; trees need the order only.

    Scikit-learn's own binning takes a hundred times as long for weighted rows.
    """
    edges = np.quantile(train, np.arange(1, BINS) / BINS, axis=0)
    binned = [np.searchsorted(edge, column) for edge, column in zip(edges.T, x.T, strict=True)]
    return np.column_stack(binned).astype(float)


def _out_of_fold(x: np.ndarray, kind: np.ndarray, flight: np.ndarray, seed: int,
                 ) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Score of each window by a model trained without its flight, its fold, and the features that separate best."""
    numbers = np.random.default_rng(seed).permutation(np.unique(flight))
    kinds = {number: (kind[flight == number].min(), kind[flight == number].max()) for number in numbers}
    ordered = sorted(numbers, key=lambda number: kinds[number])  # each fold gets flights of both kinds
    fold_of = {number: i % FOLDS for i, number in enumerate(ordered)}
    fold = np.array([fold_of[number] for number in flight])
    score, separation = np.zeros(len(x)), np.zeros(x.shape[1])
    for k in range(FOLDS):
        test, train = fold == k, fold != k
        if not test.any() or len(np.unique(kind[train])) < 2:
            continue
        bins = _bin(x[train], x)
        model = _boosting(seed).fit(bins[train], kind[train])
        score[test] = model.predict_proba(bins[test])[:, 1]
    for i in range(x.shape[1]):  # how well each feature separates alone
        separation[i] = abs(area(x[:, i], kind) - 0.5)
    names = feature_names()
    best = np.argsort(-separation)[:LISTED]
    return score, fold, tuple(f"{names[i]} ({0.5 + separation[i]:.2f} alone)" for i in best)


def _interval(score: np.ndarray, kind: np.ndarray, flight: np.ndarray, fold: np.ndarray,
              seed: int) -> tuple[float, float]:
    """Interval of `area_within` by bootstrap over flights."""
    rng = np.random.default_rng([seed, 1])
    rows = {number: np.flatnonzero(flight == number) for number in np.unique(flight)}
    numbers = list(rows)
    values = []
    for _ in range(RESAMPLES):
        sample = np.concatenate([rows[numbers[i]] for i in rng.integers(len(numbers), size=len(numbers))])
        values.append(area_within(score[sample], kind[sample], fold[sample]))
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.nanpercentile(values, [tail, 100.0 - tail])
    return float(low), float(high)
