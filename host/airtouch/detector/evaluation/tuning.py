"""Choosing a detector's thresholds and its lag on training flights."""

from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

import numpy as np

from airtouch.detector.evaluation.score import TOLERANCE_S, TrueEdge, match
from airtouch.detector.trace import Detection
from airtouch.parameters import SAMPLE_PERIOD_S

Settings = TypeVar("Settings")
EdgesAndDetections = tuple[Sequence[TrueEdge], Sequence[Detection]]  #: of one flight


def lag(flights: Iterable[EdgesAndDetections], otherwise: float = 0.0) -> float:
    """Median seconds from a true edge to its detection (positive is late); `otherwise` without any match."""
    delays = []
    for true, detections in flights:
        places = [d.sample for d in detections]
        for i, j in match([e.sample for e in true], places, TOLERANCE_S / SAMPLE_PERIOD_S):
            delays.append((detections[j].sample - true[i].sample) * SAMPLE_PERIOD_S)
    return float(np.median(delays)) if delays else otherwise


def timed_f1(flights: Iterable[EdgesAndDetections], lag_s: float = 0.0) -> float:
    """F1 of detections and true edges where a match counts 1 - |error| / 1.5 s; 0 to 1.

    One number that falls with every miss, every false edge and every second of error.
    """
    credit, counted = 0.0, 0
    for true, detections in flights:
        places = [d.sample - lag_s / SAMPLE_PERIOD_S for d in detections]
        counted += len(true) + len(places)
        for i, j in match([e.sample for e in true], places, TOLERANCE_S / SAMPLE_PERIOD_S):
            credit += 1.0 - abs(places[j] - true[i].sample) * SAMPLE_PERIOD_S / TOLERANCE_S
    return 2.0 * credit / counted if counted else 0.0


def choose(
    candidates: Iterable[Settings],
    truth: Sequence[Sequence[TrueEdge]],
    detect: Callable[[Settings, int], Sequence[Detection]],
) -> tuple[Settings, float, float]:
    """(settings, lag in seconds, timed F1) of the candidate that scores best; the first of equals.

    detect(settings, i) gives the detections in training flight i, whose edges are truth[i].
    Raises ValueError without candidates.
    """
    best: tuple[Settings, float, float] | None = None
    for settings in candidates:
        flights = [(edges, detect(settings, i)) for i, edges in enumerate(truth)]
        lag_s = lag(flights)
        score = timed_f1(flights, lag_s)
        if best is None or score > best[2]:
            best = (settings, lag_s, score)
    if best is None:
        raise ValueError("no candidates to choose from")
    return best
