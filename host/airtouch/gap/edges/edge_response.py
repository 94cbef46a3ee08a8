"""What a flight does in the second after an edge passes under it: thrust, speed along its path, height.

Nominal flights give the mean response and its scatter, by which a response is whitened. A response has COUNT numbers;
those of a signal that a log has not are NaN, and 0 once it is whitened.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from airtouch.gap.flights.flight import GROUND, PERIOD_S, Flight
from airtouch.gap.flights.heights import climbed
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.gap.workspace import Workspace
from airtouch.logs.edges import Edge, true_edges
from airtouch.logs.flight_log import POSITION, PWM, VELOCITY, FlightLog
from airtouch.logs.segments import KINDS as PHASES
from airtouch.logs.segments import PLATFORM_STEP_M
from airtouch.simulation.effects import Active
from airtouch.vehicle import Vehicle

BEFORE, AFTER = 30, 130  #: samples around an edge; chosen
BINS = ((0.1, 8), (0.2, 6), (0.2, 6))  #: width in s and number of bins: thrust, speed, height; chosen
COUNT = sum(n for _, n in BINS)
KINDS = ("entry", "exit")
LEVEL = tuple(PHASES.index(phase) for phase in ("hover", "cruise", "over platform"))  #: phases of level flight
MOST_BRIDGED = 0.1  #: share of these samples that may bridge lost rows, as of a block's; chosen
UNSURE = 3  #: samples before an edge that may belong to it already; chosen
LEAST_MPS = 1e-6  #: speed that a direction is divided by at least
LEAST_WINDOWS = 12  #: stretches without an edge, for the scatter; chosen
WINDOW_STEP = 20  #: samples from one such stretch to the next; chosen
#: weight of the diagonal in the scatter's covariance, whose stretches are few; chosen. Ledoit and Wolf 2004, whose is
#: the idea, shrink to a multiple of the identity, by a weight that they estimate from the data
SHRINKAGE = 0.3
#: share of the scatter's summed variance that is added to each variance, and that sum at least, so that the covariance
#: can be inverted; chosen
RIDGE, LEAST_VARIANCE = 1e-12, 1e-9


@dataclass(frozen=True)
class EdgeFloor:
    """What nominal flights do at edges, and its scatter.

    nominal: mean response (COUNT,) by kind, from `counts` edges each; covariance (COUNT, COUNT): of a response. Both
    NaN in the numbers of a signal that one of the nominal flights does not log.
    """

    vehicle: Vehicle
    calibration: tuple[Active, ...]
    nominal: dict[str, np.ndarray]
    counts: dict[str, int]
    covariance: np.ndarray
    workspace: Workspace = field(default_factory=Workspace, init=False, compare=False, repr=False)

    def whiten(self, deviation: np.ndarray, log: FlightLog, kind: str) -> np.ndarray:
        """A deviation (COUNT,) from the nominal response as independent standard normal numbers.

        0 in the numbers that the log or one of the nominal flights does not have, of which the others know nothing.
        """
        known = logged(log) & np.isfinite(np.diag(self.covariance))

        def make() -> np.ndarray:
            """The inverse Cholesky factor of the covariance of the known numbers."""
            return np.linalg.inv(np.linalg.cholesky(self.covariance[np.ix_(known, known)]))

        out = np.zeros(COUNT)
        out[known] = (self.workspace.cached("whiten", known.tobytes(), make) @ deviation[known]
                      / np.sqrt(1.0 + 1.0 / self.counts[kind]))
        return out


def edges_of(flight: Flight) -> list[Edge]:
    """Edges with enough flight around them, none where there is no down range.

    Those around which the samples are evidence (`_is_evidence`).
    """
    return flight.workspace.cached("edges", (),
                                   lambda: [e for e in edges_in_air(flight) if _is_evidence(flight, e.sample)])


def _is_evidence(flight: Flight, at: int) -> bool:
    """Whether nothing touches the vehicle in the samples of a response, of which at most MOST_BRIDGED are bridged."""
    window = slice(at - BEFORE, at + AFTER)
    bridged = flight.bridged[window]
    return bool((flight.usable[window] | bridged).all()) and bridged.mean() <= MOST_BRIDGED


def edges_in_air(flight: Flight) -> list[Edge]:
    """Edges with enough flight around them, whatever happens there; the library of relations was learned with these."""
    if not flight.log.has("zrange_m"):
        return []
    air = flight.phase != GROUND
    return [e for e in true_edges(flight.log, PLATFORM_STEP_M)
            if BEFORE <= e.sample < len(flight) - AFTER and air[e.sample - BEFORE:e.sample + AFTER].all()]


def response(log: FlightLog, vehicle: Vehicle, at: int) -> np.ndarray:
    """Thrust (N per motor), speed (m/s) and height (m) after sample `at`, less those before it, (COUNT,).

    NaN in numbers that the log does not have.
    """
    window = slice(at - BEFORE, at + AFTER)
    thrust, speed, height = _thrust(log, vehicle, window), _speed(log, window), _height(log, window)
    out = []
    for values, (width, n) in zip((thrust, speed, height), BINS, strict=True):
        size = int(round(width / PERIOD_S))
        values = values - values[:BEFORE - UNSURE].mean()
        out.append(values[BEFORE:BEFORE + n * size].reshape(n, size).mean(axis=1))
    return np.concatenate(out)


def logged(log: FlightLog) -> np.ndarray:
    """Which numbers (COUNT,) of a response a log has."""
    height = log.has(POSITION[2]) or log.has("zrange_m")
    return np.repeat([True, log.has(*VELOCITY[:2]), height], [n for _, n in BINS])


def _thrust(log: FlightLog, vehicle: Vehicle, window: slice) -> np.ndarray:
    """Commanded thrust, N per motor."""
    return vehicle.thrust(interpolate_missing(log.stack(PWM)[window])).mean(axis=1)


def _speed(log: FlightLog, window: slice) -> np.ndarray:
    """Speed along the path before the edge, m/s; NaN where the log has none."""
    if not log.has(*VELOCITY[:2]):
        return np.full(BEFORE + AFTER, np.nan)
    speed = interpolate_missing(log.stack(VELOCITY[:2])[window])
    heading = speed[:BEFORE].mean(axis=0)
    return speed @ (heading / max(float(np.hypot(*heading)), LEAST_MPS))


def _height(log: FlightLog, window: slice) -> np.ndarray:
    """Height, m: as logged, else the down range without its steps, else NaN."""
    if log.has(POSITION[2]):
        return interpolate_missing(log[POSITION[2]][window])
    if not log.has("zrange_m"):
        return np.full(BEFORE + AFTER, np.nan)
    return climbed(interpolate_missing(log["zrange_m"][window]), 0.5 * PLATFORM_STEP_M)


def edge_floor_of(flights: Sequence[Flight], vehicle: Vehicle, calibration: Sequence[Active]) -> EdgeFloor | None:
    """Mean response and scatter of flights declared nominal.

    None where they lack edges of a kind of KINDS, or have fewer than LEAST_WINDOWS windows of level flight without one.
    """
    responses: dict[str, list[np.ndarray]] = {k: [] for k in KINDS}
    for f in flights:
        for e in edges_of(f):
            responses[e.kind].append(response(f.log, vehicle, e.sample))
    if not all(responses.values()):
        return None
    without_edge = [response(f.log, vehicle, at) for f in flights for at in _without_edge(f, edges_in_air(f))]
    if len(without_edge) < LEAST_WINDOWS:
        return None
    known = np.isfinite(np.concatenate([without_edge, *responses.values()])).all(axis=0)
    covariance = np.full((COUNT, COUNT), np.nan)
    covariance[np.ix_(known, known)] = response_covariance(
        np.compress(known, without_edge, axis=1), {k: np.compress(known, v, axis=1) for k, v in responses.items()})
    return EdgeFloor(vehicle, tuple(calibration), {k: np.mean(v, axis=0) for k, v in responses.items()},
                     {k: len(v) for k, v in responses.items()}, covariance)


def _without_edge(flight: Flight, edges: Sequence[Edge]) -> list[int]:
    """Samples of level flight, WINDOW_STEP apart, whose responses are evidence and share no sample with an edge's."""
    level = np.isin(flight.phase, LEVEL)
    return [at for at in range(BEFORE, len(flight) - AFTER, WINDOW_STEP) if level[at - BEFORE:at + AFTER].all()
            and not any(abs(e.sample - at) < BEFORE + AFTER for e in edges) and _is_evidence(flight, at)]


def response_covariance(without_edge: np.ndarray, at_edges: Mapping[str, np.ndarray]) -> np.ndarray:
    """Covariance (k, k) of k numbers of a response: of stretches without an edge, and what edges scatter beyond them.

    without_edge: responses (stretches, k); at_edges: those (edges, k) of each kind of edge.
    """
    spread = np.cov((without_edge - np.mean(without_edge, axis=0)).T)
    out = ((1.0 - SHRINKAGE) * spread + SHRINKAGE * np.diag(np.diag(spread))
           + RIDGE * np.eye(len(spread)) * max(np.trace(spread), LEAST_VARIANCE))
    of_kinds = [v - np.mean(v, axis=0) for v in at_edges.values() if len(v) > 1]
    if of_kinds:
        deviations = np.concatenate(of_kinds)
        own = deviations.T @ deviations / max(sum(len(v) - 1 for v in at_edges.values()), 1)
        out += np.diag(np.maximum(np.diag(own) - np.diag(spread), 0.0))
    return out


def whitened(floor: EdgeFloor, flight: Flight, edge: Edge) -> np.ndarray:
    """Response of one edge less the nominal one, whitened by its scatter, (COUNT,)."""
    raw = response(flight.log, floor.vehicle, edge.sample) - floor.nominal[edge.kind]
    return floor.whiten(raw, flight.log, edge.kind)
