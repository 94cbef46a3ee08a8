"""What a report on scored flights shows, built in one place: tables, curves, and the flights to plot."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from airtouch.detector.evaluation import evaluate, summary
from airtouch.detector.evaluation.calibration import BINS, expected_calibration_error
from airtouch.detector.evaluation.score import FlightScore
from airtouch.detector.trace import Trace
from airtouch.logs import Edge
from airtouch.logs.flight_log import FlightLog

MISSED_S = 3.0  #: s, penalty of a missed edge when flights are ranked; twice `score.TOLERANCE_S`
CURVE_END_M = 1.0  #: m, where hit curves end if no error is larger; plots show less


@dataclass(frozen=True)
class ShownFlight:
    """One flight to plot: its log, the trace and score of the first detector, and the traces of the others."""

    log: FlightLog
    trace: Trace
    edges: Sequence[Edge] | None
    score: FlightScore
    others: Mapping[str, Trace] = field(default_factory=dict)


@dataclass(frozen=True)
class HitCurve:
    """Share of all true edges that are detected within a distance: a step curve.

    distance_m, share: (n+2,), ascending, from distance 0 to at least 1 m. The share holds from one distance to the
    next. Missed edges keep it below 1. edges: number of true edges.
    """

    distance_m: np.ndarray
    share: np.ndarray
    edges: int


@dataclass(frozen=True)
class Reliability:
    """Probability stated (k,), share truly over a platform (k,) and share of the samples (k,), of the bins in use."""

    stated: np.ndarray
    truly: np.ndarray
    samples: np.ndarray
    ece: float


@dataclass(frozen=True)
class ScoreReport:
    """Tables and curves of every detector, the one that is reported on first, and a few flights of it.

    summaries: detector -> figures (`summary.summarise`). breakdowns: title -> value -> figures.
    """

    summaries: Mapping[str, dict[str, Any]]
    breakdowns: Mapping[str, Mapping[str, dict[str, Any]]]
    hits: Mapping[str, HitCurve]
    reliability: Mapping[str, Reliability]
    flights: Sequence[ShownFlight]


def score_report(scores: Mapping[str, Sequence[FlightScore]], flights: Sequence[ShownFlight] = ()) -> ScoreReport:
    """Everything that a report on detectors shows. scores: detector -> its flights; the report is about the first."""
    first = next(iter(scores))
    return ScoreReport(
        {name: summary.summarise(some) for name, some in scores.items()},
        {f"{first} by height": summary.by_centimetre(scores[first]),
         f"{first} by approach angle, degrees": summary.by_angle(scores[first]),
         f"{first} by wind": summary.by_wind(scores[first])},
        {name: hit_curve(some) for name, some in scores.items()},
        {name: reliability_of(some) for name, some in scores.items()}, flights)


def hit_curve(scores: Sequence[FlightScore]) -> HitCurve:
    """The hit curve of some flights. An edge without a distance error (missed, or flown at unknown speed) is no hit."""
    edges = [e for s in scores for e in s.edges]
    errors = np.sort([abs(e.error_m) for e in edges if e.error_m is not None])
    hits = np.r_[0, np.arange(1, len(errors) + 1), len(errors)]
    return HitCurve(np.r_[0.0, errors, max([CURVE_END_M, *errors])], hits / max(len(edges), 1), len(edges))


def reliability_of(scores: Sequence[FlightScore]) -> Reliability:
    """How often the drone was over a platform when a detector said so with some probability."""
    table = np.sum([s.bins for s in scores], axis=0) if scores else np.zeros((BINS, 3))
    count, stated, truly = table[table[:, 0] > 0].T
    return Reliability(stated / count, truly / count, count / max(count.sum(), 1.0),
                       float(expected_calibration_error(table)))


def shown_flights(results: Mapping[str, Sequence[evaluate.Result]], most: int) -> list[ShownFlight]:
    """At most `most` flights of the first detector, from its best to its worst, with the other detectors' traces."""
    first, *others = results
    ranked = sorted(results[first], key=_badness)
    count = min(most, len(ranked))
    chosen = [ranked[i * (len(ranked) - 1) // max(count - 1, 1)] for i in range(count)]
    traces = {name: {r.score.flight: r.trace for r in results[name]} for name in others}
    return [ShownFlight(r.log, r.trace, evaluate.truth(r.log), r.score,
                        {name: of[r.score.flight] for name, of in traces.items() if r.score.flight in of})
            for r in chosen]


def _badness(result: evaluate.Result) -> float:
    """Rank of a flight in seconds: the edges' absolute errors, MISSED_S for each missed one, 1 s for each false one."""
    errors = [abs(e.error_s) if e.error_s is not None else MISSED_S for e in result.score.edges]
    return sum(errors) + len(result.score.false or ())
