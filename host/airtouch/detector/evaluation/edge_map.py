"""Detected edges in the plane: points, polylines and fitted polygons, with their uncertainty.

A pass is one stretch over a platform: an entry and the exit after it. In a zig-zag flight the
ends of successive passes that lie beside each other belong to one platform; joined, they are
its outline. Everything is in metres, in the frame of the positions given.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPoint, Point, Polygon, mapping

from airtouch.detector import registry
from airtouch.detector.best import sensor_note
from airtouch.detector.best.model import BestModel, is_shipped
from airtouch.detector.evaluation import evaluate
from airtouch.detector.shared import sensors
from airtouch.detector.trace import Detection
from airtouch.errors import AirTouchError
from airtouch.logs import Edge, true_edges
from airtouch.logs.alignment import HOLD_S
from airtouch.logs.checks.clock import sample_period
from airtouch.logs.flight_log import FlightLog
from airtouch.parameters import SAMPLE_PERIOD_S
from airtouch.vehicle import arm_pwm_of

ASSUMED_SIGMA_S = 0.1  #: s, timing error of a detection by a model that states none
TRUE_SIGMA_S = 0.01  #: s, timing error of an edge of the down range: one sample
MIN_SPEED_MPS = 0.05  #: m/s, least speed by which a timing error is multiplied
SPEED_S = 0.1  #: s before and after a detection over which the speed is taken; chosen
#: distances between successive passes below this fraction of ROW_QUANTILE of all are not from row to row; chosen
ROW_FRACTION, ROW_QUANTILE = 0.3, 0.9
ROWS_APART = 4.0  #: most distance between passes over one platform, in median distances of rows; chosen


@dataclass(frozen=True)
class EdgePoint:
    """A detected edge: time, kind ("entry", "exit", "edge"), position and 1-sigma along the track.

    time_s: of the detection from the log's first sample, with the detector's lag; x_m, y_m: without that lag. Position
    and sigma are NaN where the track has none.
    """

    sample: int
    time_s: float
    kind: str
    x_m: float
    y_m: float
    sigma_m: float

    @property
    def has_position(self) -> bool:
        """Whether the track had a position at this edge."""
        return bool(np.isfinite(self.sigma_m))


@dataclass(frozen=True)
class Platform:
    """One platform: its two polylines, its outline, the rectangle around it and 1-sigma of the outline.

    outline is None where a single pass crossed it: two points span no area.
    """

    near_side: LineString | Point
    far_side: LineString | Point
    outline: Polygon | None
    rectangle: Polygon | None
    sigma_m: float


@dataclass(frozen=True)
class EdgeMap:
    """The edges of one flight in the plane, m.

    xy: track (n, 2). points: edges along it that have a position. position: source of the positions. lag_s, sigma_s: of
    the detections. without_position: number of edges that have no position.
    """

    xy: np.ndarray
    points: list[EdgePoint]
    platforms: list[Platform]
    position: str
    lag_s: float
    sigma_s: float
    without_position: int = 0


@dataclass(frozen=True)
class TimedEdges:
    """Edges of a flight, their constant lag (s) and 1-sigma of their time (s)."""

    edges: Sequence[Edge | Detection]
    lag_s: float
    sigma_s: float


def true_edges_of(log: FlightLog) -> TimedEdges:
    """The edges of the down range, in the air by the vehicle that the log names."""
    return TimedEdges(true_edges(log, arm_pwm=arm_pwm_of(log.meta)), 0.0, TRUE_SIGMA_S)


def detected_edges(log: FlightLog, detector: str = "best", model: Path | None = None) -> TimedEdges:
    """The edges that a detector reports, with the shipped model for None; their timing error is assumed for most.

    Raises AirTouchError for an unknown detector, a model that is not its own, and a log that lacks what it needs.
    """
    module = registry.get(detector)
    loaded = module.load(model)
    evaluate.check(log, evaluate.spare_of(module), evaluate.arm_pwm_by(module, loaded))
    trained = registry.model_for(module, loaded, log)
    return TimedEdges(module.run(log, trained).edges, module.lag_s(trained), _sigma_s(trained, log))


def _sigma_s(model: Any, log: FlightLog) -> float:
    """Timing error of the model's detections, s: what it states, or ASSUMED_SIGMA_S.

    Of the shipped `best` without a sensor at least its mean absolute error there, which an rms error is never below.
    """
    stated = float(getattr(model, "metadata", {}).get("sigma_s", ASSUMED_SIGMA_S))
    missing = sensors.missing_sensors(log)
    if not (missing and isinstance(model, BestModel) and is_shipped(model, missing)):
        return stated
    return max(stated, sensor_note.figures()[missing[0]]["mean_abs_error_s"])


def edge_map(log: FlightLog, edges: Sequence[Edge | Detection], *, lag_s: float = 0.0, sigma_s: float = ASSUMED_SIGMA_S,
             speed_mps: float | None = None, heading_deg: float = 0.0) -> EdgeMap:
    """The map of the edges that were found in a flight, by a detector with a lag or in the down range.

    sigma_s: timing error of an edge, s. speed_mps, heading_deg: for dead reckoning, where the log has no position; only
    distances from the first edge mean something then, and that is the origin. Raises as `track` does, and where the log
    has a position at none of the edges.
    """
    xy, measured = track(log, speed_mps, heading_deg)
    period = sample_period(log)
    if not measured and edges:
        xy = xy - xy[int(np.clip(round(edges[0].sample - lag_s / period), 0, len(xy) - 1))]
    points = edge_points(xy, [e.sample for e in edges], [e.kind for e in edges], period_s=period, sigma_s=sigma_s,
                         lag_s=lag_s)
    position = "logged" if measured else "dead reckoning, from the first edge"
    placed = [p for p in points if p.has_position]
    if points and not placed:
        raise AirTouchError(f"{log.source}: no position (x_m, y_m) at any of the {len(points)} edges; without these "
                            "columns, --speed places the edges along the track")
    return EdgeMap(xy, placed, platforms(points), position, lag_s, sigma_s, len(points) - len(placed))


def track(log: FlightLog, speed_mps: float | None = None, heading_deg: float = 0.0) -> tuple[np.ndarray, bool]:
    """The flown track, shape (n, 2), metres, and whether it was measured.

    Logged x_m, y_m where they hold a value, NaN where there is none for more than HOLD_S; else dead reckoning at
    constant speed along one heading, which places edges relative to each other along the track, and nowhere else.
    Raises AirTouchError if there is neither.
    """
    if log.has("x_m", "y_m"):
        xy = log.stack(("x_m", "y_m"))
        logged = np.flatnonzero(np.isfinite(xy).all(axis=1))
        if len(logged):
            return _without_short_gaps(xy, logged, HOLD_S / sample_period(log)), True
    if speed_mps is None:
        raise AirTouchError(f"{log.source}: no position (x_m, y_m) in this log; give the speed: --speed 0.2")
    along = np.arange(len(log)) * sample_period(log) * speed_mps
    heading = np.radians(heading_deg)
    return np.column_stack((along * np.cos(heading), along * np.sin(heading))), False


def _without_short_gaps(xy: np.ndarray, logged: np.ndarray, most_rows: float) -> np.ndarray:
    """The track (n, 2) with straight lines between logged rows (k,) that are at most `most_rows` apart."""
    apart = np.diff(logged)
    rows = np.arange(logged[0], logged[-1])[np.repeat(apart <= most_rows, apart)]
    filled = xy.copy()
    filled[rows] = np.column_stack([np.interp(rows, logged, column[logged]) for column in xy.T])
    return filled


def edge_points(
    xy: np.ndarray, samples: Sequence[int] | np.ndarray, kinds: list[str], *, period_s: float = SAMPLE_PERIOD_S,
    sigma_s: float = ASSUMED_SIGMA_S, lag_s: float = 0.0,
) -> list[EdgePoint]:
    """Each detection as a point of the track, without a position where the track misses one within SPEED_S of it.

    xy: track, (n, 2), metres, a row each period_s. samples: index of each detection; lag_s, the constant lag of the
    detector, is subtracted. sigma_s: timing error of a detection; sigma_m is its product with the speed at that sample.
    """
    points = []
    half = max(1, round(SPEED_S / period_s))
    for sample, kind in zip(samples, kinds, strict=True):
        at = int(np.clip(round(sample - lag_s / period_s), 0, len(xy) - 1))
        low, high = max(0, at - half), min(len(xy) - 1, at + half)
        x, y, sigma_m = np.nan, np.nan, np.nan
        if np.isfinite(xy[[low, at, high]]).all() and high > low:
            speed = float(np.hypot(*(xy[high] - xy[low]))) / ((high - low) * period_s)
            x, y, sigma_m = *map(float, xy[at]), sigma_s * max(speed, MIN_SPEED_MPS)
        points.append(EdgePoint(int(sample), sample * period_s, kind, x, y, sigma_m))
    return points


def passes(points: list[EdgePoint]) -> list[tuple[EdgePoint, EdgePoint]]:
    """Pairs of an entry and the next exit. An entry without an exit is left out, and an exit without an entry.

    So is a pair with an end that has no position. `points` must hold these too, so that no end of another pass follows.
    """
    ordered = sorted(points, key=lambda p: p.sample)
    return [(a, b) for a, b in pairwise(ordered)
            if a.kind == "entry" and b.kind == "exit" and a.has_position and b.has_position]


def platforms(points: list[EdgePoint]) -> list[Platform]:
    """The platforms of a flight, each with its outline. points: all edges, also those without a position.

    Two passes belong together where they overlap along the direction of flight and lie, across it,
    no further apart than ROWS_APART times the median distance between successive rows. Rows without an edge that were
    flown between two passes are not looked at: two platforms across the rows, nearer than that, become one.
    """
    crossed = passes(points)
    groups: list[list[tuple[EdgePoint, EdgePoint]]] = []
    gaps = np.array([_distance(a, b) for a, b in pairwise(crossed)])
    rows = gaps[gaps > ROW_FRACTION * np.quantile(gaps, ROW_QUANTILE)] if len(gaps) else gaps
    reach = ROWS_APART * float(np.median(rows)) if len(rows) else 0.0
    for crossing in crossed:
        for group in groups:
            if any(_adjacent(other, crossing, reach) for other in group[-2:]):
                group.append(crossing)
                break
        else:
            groups.append([crossing])
    return [_fit(group) for group in groups]


def _distance(one: tuple[EdgePoint, EdgePoint], other: tuple[EdgePoint, EdgePoint]) -> float:
    """Distance between two passes across the direction of the first, metres."""
    a, b = _ends(one), _ends(other)
    direction, between = a[1] - a[0], (b - a).mean(axis=0)
    length = float(np.hypot(*direction))
    return abs(float(direction[0] * between[1] - direction[1] * between[0])) / length if length else 0.0


def _ends(crossing: tuple[EdgePoint, EdgePoint]) -> np.ndarray:
    """Positions of a pass's entry and exit, (2, 2), metres."""
    return np.array([[p.x_m, p.y_m] for p in crossing])


def _adjacent(one: tuple[EdgePoint, EdgePoint], other: tuple[EdgePoint, EdgePoint], reach: float) -> bool:
    """Whether two passes overlap along the first one and lie at most `reach` metres apart across it."""
    a, b = _ends(one), _ends(other)
    direction = a[1] - a[0]
    length = float(np.hypot(*direction))
    if length == 0.0:
        return False
    shadow = np.sort((b - a[0]) @ direction / length)
    return bool(shadow[0] < length and shadow[1] > 0 and _distance(one, other) <= reach)


def _fit(group: list[tuple[EdgePoint, EdgePoint]]) -> Platform:
    """The platform of a group of passes.

    Its outline joins the ends of the passes on either side to a ring, simplified within the uncertainty.
    """
    ends = [_ends(crossing) for crossing in group]
    direction = ends[0][1] - ends[0][0]
    aligned = [pair if (pair[1] - pair[0]) @ direction >= 0 else pair[::-1] for pair in ends]
    across = np.array([-direction[1], direction[0]])
    aligned.sort(key=lambda pair: float(pair.mean(axis=0) @ across))
    near, far = (np.array([pair[side] for pair in aligned]) for side in (0, 1))
    sigma = float(np.sqrt(np.mean([p.sigma_m**2 for crossing in group for p in crossing])))
    if len(group) == 1:
        return Platform(Point(near[0]), Point(far[0]), None, None, sigma)
    ring = Polygon(np.vstack((near, far[::-1])))
    if not ring.is_valid:
        ring = shapely.make_valid(ring)
        ring = max(getattr(ring, "geoms", [ring]), key=lambda part: part.area)
    outline = ring.simplify(sigma) if isinstance(ring, Polygon) and ring.area > 0 else None
    box = MultiPoint(np.vstack((near, far))).minimum_rotated_rectangle
    rectangle = box if isinstance(box, Polygon) else None
    return Platform(LineString(near), LineString(far), outline, rectangle, sigma)


def geojson(points: list[EdgePoint], platforms: list[Platform], properties: dict) -> dict:
    """A GeoJSON FeatureCollection in a local metric plane (not longitude and latitude; it says so).

    The "95 % band of the outline" is 2 sigma of the timing on either side of the line, not a confidence region of the
    outline: it does not hold that the platform ends up to a row beyond its first and last pass, which lie inside it.
    The area is too small by that too.
    """
    features = [
        _feature(Point(p.x_m, p.y_m), role="edge", kind=p.kind, sample=p.sample, sigma_m=round(p.sigma_m, 4))
        for p in points
    ]
    for number, platform in enumerate(platforms):
        shared = {"platform": number, "sigma_m": round(platform.sigma_m, 4)}
        features += [_feature(line, role=role, **shared)
                     for role, line in (("near side", platform.near_side), ("far side", platform.far_side))
                     if isinstance(line, LineString)]
        for role, polygon in (("outline", platform.outline), ("rectangle", platform.rectangle)):
            if polygon is not None:
                band = polygon.boundary.buffer(2 * platform.sigma_m)
                features.append(_feature(polygon, role=role, area_m2=round(polygon.area, 4), **shared))
                if role == "outline":
                    features.append(_feature(band, role="95 % band of the outline", **shared))
    return {"type": "FeatureCollection", "properties": {"axes": "local plane, metres", **properties},
            "features": features}


def _feature(geometry: shapely.Geometry, **properties: object) -> dict:
    """A GeoJSON Feature."""
    return {"type": "Feature", "geometry": mapping(geometry), "properties": properties}
