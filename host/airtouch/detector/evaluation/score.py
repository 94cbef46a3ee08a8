"""Scores of one flight: detections matched one to one with true edges."""

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from scipy.optimize import linear_sum_assignment

from airtouch.detector.evaluation.calibration import BINS, reliability
from airtouch.detector.evaluation.data.dataset import Condition
from airtouch.detector.trace import Detection, Trace
from airtouch.parameters import SAMPLE_PERIOD_S

TOLERANCE_S = 1.5  #: a detection further than this from every true edge is false
HIT_RADII_M = (0.05, 0.10, 0.25)  #: 0.05 m is that of the paper (its errors by height)


class TrueEdge(Protocol):
    """What a score reads of a true edge (`airtouch.logs.Edge`)."""

    @property
    def sample(self) -> int:
        """Index of the crossing, in samples of 10 ms."""

    @property
    def kind(self) -> str:
        """"entry" or "exit"."""


@dataclass(frozen=True)
class EdgeScore:
    """One true edge and the detection matched with it, if any.

    error_s, error_m: positive is early, as in the paper; the detector's lag is already subtracted.
    """

    kind: str
    true_sample: int
    detected_sample: int | None = None
    detected_kind: str | None = None
    error_s: float | None = None
    error_m: float | None = None


class WindowCounts(NamedTuple):
    """Counts of samples; positive are those over a platform, true those that the detector classifies correctly."""

    true_positives: int = 0
    positives: int = 0
    true_negatives: int = 0
    negatives: int = 0


@dataclass(frozen=True)
class FlightScore:
    """The score of one flight; everything in it is additive over flights.

    false: samples of unmatched detections, None where the true edges are unknown.
    windows: counts of airborne samples, at which the lag is not subtracted.
    bins: reliability table, (10, 3), likewise. airborne_s: seconds in the air. note: what limits the result, one line.
    in_training: whether the model was trained on this flight. path: of the log, "" in results of an older version.
    """

    file: str
    condition: Condition
    edges: tuple[EdgeScore, ...]
    false: tuple[int, ...] | None
    detections: int
    airborne_s: float
    windows: WindowCounts = WindowCounts()
    bins: np.ndarray = field(default_factory=lambda: np.zeros((BINS, 3)))
    note: str = ""
    in_training: bool = False
    path: str = ""

    @property
    def flight(self) -> str:
        """What tells the flight from others: its full path, for files in two folders may have the same name."""
        return os.path.realpath(self.path) if self.path else self.file

    def balanced_accuracy(self) -> float | None:
        """Mean of sensitivity and specificity of the windows, 0 to 1; None without positives or without negatives."""
        true_positives, positives, true_negatives, negatives = self.windows
        if not positives or not negatives:
            return None
        return 0.5 * (true_positives / positives + true_negatives / negatives)

    def as_dict(self) -> dict:
        """The flight's entry in `per_flight` of the JSON."""
        return {
            "file": self.file,
            "condition": asdict(self.condition),
            "edges": [asdict(edge) for edge in self.edges],
            "false": None if self.false is None else list(self.false),
            "detections": self.detections,
            "balanced_accuracy": self.balanced_accuracy(),
            "airborne_s": self.airborne_s,
            "windows": list(self.windows),
            "reliability": self.bins.tolist(),
            "note": self.note,
            "in_training": self.in_training,
            "path": self.path,
        }

    @classmethod
    def from_dict(cls, entry: dict) -> "FlightScore":
        """The inverse of `as_dict`; raises KeyError or TypeError for another shape."""
        false = entry["false"]
        return cls(
            entry["file"], Condition(**entry["condition"]), tuple(EdgeScore(**e) for e in entry["edges"]),
            None if false is None else tuple(false), entry["detections"], entry["airborne_s"],
            WindowCounts(*entry["windows"]), np.array(entry["reliability"], float), entry["note"],
            entry.get("in_training", False), entry.get("path", ""))


def match(true: Sequence[float], detected: Sequence[float], tolerance: float) -> list[tuple[int, int]]:
    """Pairs (index into true, index into detected) at most `tolerance` apart, one to one.

    As many pairs as possible, and among those the least total distance. Units: any, the same.
    """
    if not len(true) or not len(detected):
        return []
    distance = np.abs(np.subtract.outer(np.asarray(true, float), np.asarray(detected, float)))
    allowed = distance <= tolerance
    forbidden = (min(distance.shape) + 1) * (tolerance + 1.0)  # dearer than any set of allowed pairs
    rows, columns = linear_sum_assignment(np.where(allowed, distance, forbidden))
    return [(int(r), int(c)) for r, c in zip(rows, columns, strict=True) if allowed[r, c]]


def score_edges(
    true: Sequence[TrueEdge], detections: Sequence[Detection], speed_mps: float | None, lag_s: float = 0.0
) -> tuple[tuple[EdgeScore, ...], tuple[int, ...]]:
    """One score for each true edge, and the samples of the detections that match none.

    The lag (s, constant, learnt in training) is subtracted from every detection first.
    An entry may match an exit. Without a speed, errors in metres are None.
    """
    places = [d.sample - lag_s / SAMPLE_PERIOD_S for d in detections]
    pairs = dict(match([e.sample for e in true], places, TOLERANCE_S / SAMPLE_PERIOD_S))
    scores = []
    for index, edge in enumerate(true):
        if index not in pairs:
            scores.append(EdgeScore(edge.kind, edge.sample))
            continue
        detection = detections[pairs[index]]
        error_s = (edge.sample - places[pairs[index]]) * SAMPLE_PERIOD_S
        error_m = None if speed_mps is None else error_s * speed_mps
        scores.append(EdgeScore(edge.kind, edge.sample, detection.sample, detection.kind, error_s, error_m))
    used = set(pairs.values())
    return tuple(scores), tuple(d.sample for i, d in enumerate(detections) if i not in used)


def over_platform(edges: Sequence[TrueEdge] | Sequence[Detection], samples: int) -> np.ndarray:
    """Whether the drone is over a platform at each sample, (samples,) bool: the last edge so far was an entry.

    If the first edge is an exit, the drone was over a platform before it. An "edge" of unknown kind toggles the state.
    """
    over = np.zeros(samples, bool)
    if edges and edges[0].kind == "exit":
        over[: edges[0].sample] = True
    state = False
    for edge in edges:
        state = not state if edge.kind == "edge" else edge.kind == "entry"
        over[edge.sample :] = state
    return over


def score_flight(
    file: str,
    condition: Condition,
    true: Sequence[TrueEdge] | None,
    airborne: np.ndarray,
    trace: Trace,
    lag_s: float = 0.0,
) -> FlightScore:
    """The score of one flight of n samples.

    true: edges, or None where the log has no down range; then no detection is called false.
    airborne: (n,) bool. trace: of the detector; its probability of being over a platform, 0.5 and more, predicts it,
    and where it has none (all NaN) the state between its edges does. Edges on the ground count too.
    lag_s: subtracted from the detections before edges are matched, and from nothing else: windows and bins judge the
    state at each sample as the detector says it at that sample.
    """
    probability, detections = trace.probability, trace.edges
    airborne_s = float(np.count_nonzero(airborne)) * SAMPLE_PERIOD_S
    if true is None:
        note = "no down range in this log: detections are listed, not judged"
        return FlightScore(file, condition, (), None, len(detections), airborne_s, note=note)
    edges, false = score_edges(true, detections, condition.speed_mps, lag_s)
    over = over_platform(true, len(airborne))
    known = airborne & np.isfinite(probability)
    predicted = probability >= 0.5
    if not np.isfinite(probability).any():
        known, predicted = airborne, over_platform(detections, len(airborne))
    windows = WindowCounts(*(int(np.count_nonzero(known & mask))
                             for mask in (over & predicted, over, ~over & ~predicted, ~over)))
    bins = reliability(np.where(airborne, probability, np.nan), over)
    return FlightScore(file, condition, edges, false, len(detections), airborne_s, windows, bins)
