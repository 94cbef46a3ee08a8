"""Ratio of recorded to simulated edges by height, and simulated edges scaled by it.

Simulated edges of high flights are too weak: 6.5 cm and more over the platform, the median of vertical acceleration and
motor mean around an edge is about half of the recorded one (host/docs/twin-findings.md). A detector that has learnt
weak edges is unsure of them.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog
from airtouch.twin import overlay
from airtouch.twin.overlay import RATE_HZ, Response
from airtouch.twin.recorded.course import course
from airtouch.twin.recorded.features import BASELINE_S, height_class

#: kinds of edge, in the order of a response's edges
KINDS = ("entry", "exit")
#: s after an edge that are compared: less than the shortest pass of folds 0 to 2, 1.35 s (host/docs/twin-findings.md,
#: November 2023)
WINDOW_S = 1.2
#: typical size at an edge of vertical acceleration, m/s^2, and motor mean, PWM; no source: round numbers
UNITS = np.array([0.5, 1500.0])
MIN_FLIGHTS = 3  #: recorded flights, and responses, that a class of height needs; no source: least for a median
#: bounds of the factor by which simulated edges are scaled; no source: round numbers around the 1.1 to 2.4 measured
#: (host/docs/twin-findings.md, why high flights are missed)
BOUNDS = (1.0, 3.0)
#: s from an edge to where its factor begins to pass into that of the other edge; no source: round number
BLEND_START_S = 0.2
SPEED_MPS = 0.3  #: m/s, speed of a course where only its edges are used; no effect on them

#: (class of height, "entry" or "exit") -> ratio of recorded to simulated edges
Strengths = dict[tuple[str, str], float]


def strengths(flights: Sequence[FlightLog], responses: Sequence[Response],
              bounds: tuple[float, float] = BOUNDS) -> Strengths:
    """The factor for each kind of edge and class of height of which there are MIN_FLIGHTS flights and responses.

    Least squares of the recorded median course on the simulated one, vertical acceleration and motor mean together,
    within the bounds. Flights whose down range shows no platform do not count. The heights that class them are not the
    same one: a recorded flight's is the median over its pass, a response's that just after its entry, here and in
    `scale` and `balance_heights`. A flight near the bound of a class may so be in another than its simulated likeness.
    """
    recorded: dict[tuple[str, str], list[np.ndarray]] = {}
    simulated: dict[tuple[str, str], list[np.ndarray]] = {}
    for log in flights:
        try:
            recorded_course, values = course(log, SPEED_MPS), overlay.values_of(log)
        except AirTouchError:
            continue
        name = height_class(recorded_course.clearance_m)
        first, last = (recorded_course.entry + round(s * RATE_HZ) for s in BASELINE_S)
        if name and first >= 0:
            level = values[first:last].mean(axis=0)
            for kind, sample, end in (("entry", recorded_course.entry, recorded_course.exit),
                                      ("exit", recorded_course.exit, len(values))):
                recorded.setdefault((name, kind), []).append(_window(values - level, sample, end))
    for response in responses:
        name = height_class(response.edges[0].height_after_m)
        for kind, edge in zip(KINDS, response.edges, strict=True):
            if name:
                window = _window(response.values, edge.sample, len(response.values))
                simulated.setdefault((name, kind), []).append(window)
    return {key: float(np.clip(_slope(recorded[key], simulated[key]), *bounds)) for key in simulated
            if len(recorded.get(key, ())) >= MIN_FLIGHTS and len(simulated[key]) >= MIN_FLIGHTS}


def scale(response: Response, factors: Strengths) -> Response:
    """The response times the factors of its height, that of the entry passing into that of the exit over the platform.

    The response of a class without a factor stays as it is.
    """
    name = height_class(response.edges[0].height_after_m)
    at_entry, at_exit = (factors.get((str(name), kind), 1.0) for kind in KINDS)
    entry, leave = (edge.sample for edge in response.edges)
    margin = min(round(BLEND_START_S * RATE_HZ), (leave - entry) // 2)
    gain = np.interp(np.arange(len(response.values)), [entry + margin, leave - margin], [at_entry, at_exit])
    return replace(response, values=response.values * gain[:, None])


def balance_heights(responses: Sequence[Response]) -> list[Response]:
    """The same number of responses, the same from each class of height; those of a class with few are repeated.

    Most recorded heights are low, where an edge is easily learnt.
    """
    classes: dict[str | None, list[Response]] = {}
    for response in responses:
        classes.setdefault(height_class(response.edges[0].height_after_m), []).append(response)
    turns = (group[i % len(group)] for i in range(len(responses)) for group in classes.values())
    return list(islice(turns, len(responses)))


def _slope(recorded: Sequence[np.ndarray], simulated: Sequence[np.ndarray]) -> float:
    """Least-squares factor from the median of simulated windows to that of recorded ones."""
    real, model = (np.nan_to_num(_median(windows)) for windows in (recorded, simulated))
    return (real * model).sum() / max((model * model).sum(), 1e-12)


def _median(windows: Sequence[np.ndarray]) -> np.ndarray:
    """Median (rows, 2) of windows, NaN in rows that none of them reaches."""
    stacked = np.array(windows)
    rows = np.isfinite(stacked[:, :, 0]).any(axis=0)
    out = np.full(stacked.shape[1:], np.nan)
    out[rows] = np.nanmedian(stacked[:, rows], axis=0)
    return out


def _window(values: np.ndarray, edge: int, end: int) -> np.ndarray:
    """Vertical acceleration and motor mean (rows, 2) in UNITS, over WINDOW_S from the edge on, NaN from `end` on."""
    out = np.full((round(WINDOW_S * RATE_HZ), len(UNITS)), np.nan)
    part = values[edge:min(end, edge + len(out))]
    vertical = len(overlay.ACC_WORLD) - 1
    mean = part[:, -len(overlay.PWM):].mean(axis=1)
    out[:len(part)] = np.column_stack([part[:, vertical], mean]) / UNITS
    return out
