"""Scores of one flight: detections matched one to one with true edges."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Protocol

import numpy as np
from scipy.optimize import linear_sum_assignment

from airtouch.detector.evaluation.calibration import BINS, reliability
from airtouch.detector.evaluation.dataset import Condition
from airtouch.detector.trace import Detection

TOLERANCE_S = 1.5  #: a detection further than this from every true edge is false
HIT_RADII_M = (0.05, 0.10, 0.25)
SAMPLE_PERIOD_S = 0.01


class TrueEdge(Protocol):
    """What is needed of a true edge (`airtouch.logs.Edge`)."""

    @property
    def sample(self) -> int:
        """Index at which it is."""

    @property
    def kind(self) -> str:
        """"entry" or "exit"."""


@dataclass(frozen=True)
class EdgeScore:
    """One true edge and the detection matched with it, if any.

    error_s, error_m: positive is early, as in the paper; the lag is already taken off.
    """

    kind: str
    true_sample: int
    detected_sample: int | None = None
    detected_kind: str | None = None
    error_s: float | None = None
    error_m: float | None = None


@dataclass(frozen=True)
class FlightScore:
    """The score of one flight; everything in it is additive over flights.

    false: samples of unmatched detections, None where the truth is not known.
    windows: airborne samples (over and found, over, not over and found, not over).
    bins: reliability table, (10, 3). airborne_s: seconds in the air. note: what limits the result, one line.
    in_training: whether the model was trained on this flight.
    """

    file: str
    condition: Condition
    edges: tuple[EdgeScore, ...]
    false: tuple[int, ...] | None
    detections: int
    airborne_s: float
    windows: tuple[int, int, int, int] = (0, 0, 0, 0)
    bins: np.ndarray = field(default_factory=lambda: np.zeros((BINS, 3)))
    note: str = ""
    in_training: bool = False

    def balanced_accuracy(self) -> float | None:
        """Mean of the shares found over and not over a platform; None without both."""
        over_found, over, rest_found, rest = self.windows
        return 0.5 * (over_found / over + rest_found / rest) if over and rest else None

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
        }

    @classmethod
    def from_dict(cls, entry: dict) -> "FlightScore":
        """The inverse of `as_dict`; raises KeyError or TypeError for another shape."""
        false = entry["false"]
        return cls(
            entry["file"], Condition(**entry["condition"]), tuple(EdgeScore(**e) for e in entry["edges"]),
            None if false is None else tuple(false), entry["detections"], entry["airborne_s"],
            tuple(entry["windows"]), np.array(entry["reliability"], float), entry["note"],
            entry.get("in_training", False))


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
    """(one score a true edge, samples of the unmatched detections).

    The lag (s, constant, learnt in training) is taken off every detection first.
    Kinds do not matter for the match. Without a speed, errors in metres are None.
    """
    places = [d.sample - lag_s / SAMPLE_PERIOD_S for d in detections]
    pairs = dict(match([e.sample for e in true], places, TOLERANCE_S / SAMPLE_PERIOD_S))
    scores = []
    for index, edge in enumerate(true):
        if index not in pairs:
            scores.append(EdgeScore(edge.kind, edge.sample))
            continue
        found = detections[pairs[index]]
        error_s = (edge.sample - places[pairs[index]]) * SAMPLE_PERIOD_S
        error_m = None if speed_mps is None else error_s * speed_mps
        scores.append(EdgeScore(edge.kind, edge.sample, found.sample, found.kind, error_s, error_m))
    used = set(pairs.values())
    return tuple(scores), tuple(d.sample for i, d in enumerate(detections) if i not in used)


def over_platform(edges: Sequence[TrueEdge] | Sequence[Detection], samples: int) -> np.ndarray:
    """(samples,) bool: whether the last edge so far was an entry; a first exit means over until then.

    An "edge" of unknown kind changes the state.
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
    probability: np.ndarray,
    detections: Sequence[Detection],
    lag_s: float = 0.0,
) -> FlightScore:
    """The score of one flight of n samples.

    true: edges, or None where the log holds no down range: then nothing can be
    called false. airborne: (n,) bool. probability: (n,), windows count as over
    from 0.5; a detector without probabilities is judged by the state between its
    detections. Every detection of the log counts, on the ground too.
    """
    airborne_s = float(np.count_nonzero(airborne)) * SAMPLE_PERIOD_S
    if true is None:
        note = "no down range in this log: detections are listed, not judged"
        return FlightScore(file, condition, (), None, len(detections), airborne_s, note=note)
    edges, false = score_edges(true, detections, condition.speed_mps, lag_s)
    over = over_platform(true, len(airborne))
    known = airborne & np.isfinite(probability)
    said = probability >= 0.5
    if not np.isfinite(probability).any():
        known, said = airborne, over_platform(detections, len(airborne))
    found, there, silent, elsewhere = (int(np.count_nonzero(known & mask))
                                       for mask in (over & said, over, ~over & ~said, ~over))
    bins = reliability(np.where(airborne, probability, np.nan), over)
    return FlightScore(file, condition, edges, false, len(detections), airborne_s,
                       (found, there, silent, elsewhere), bins)
