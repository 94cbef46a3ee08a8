"""What a flight does in the second after an edge passes under it: thrust, speed along its path, height.

Effects of the height control and of the optical flow show there alone. Nominal flights
give the mean response and its scatter; what an effect adds to it comes from
the simulator, flown with and without the effect over a platform like the flight's.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from airtouch.gap.flights import motion
from airtouch.gap.flights.flight import PERIOD_S, Flight
from airtouch.gap.signatures.candidates import terms
from airtouch.gap.signatures.signature import signature_of
from airtouch.gap.workspace import Workspace
from airtouch.logs.edges import Edge, true_edges
from airtouch.logs.flight_log import POSITION, PWM, VELOCITY, FlightLog
from airtouch.logs.segments import KINDS as PHASES
from airtouch.logs.segments import PLATFORM_STEP_M
from airtouch.simulation import scenario
from airtouch.simulation.batch import flights as simulated
from airtouch.simulation.effects import Active
from airtouch.vehicle import Vehicle

BEFORE, AFTER = 30, 130  #: samples around an edge; chosen
BINS = ((0.1, 8), (0.2, 6), (0.2, 6))  #: width in s and number of bins: thrust, speed, height; chosen
COUNT = sum(n for _, n in BINS)
KINDS = ("entry", "exit")
LEVEL = tuple(PHASES.index(phase) for phase in ("hover", "cruise", "over platform"))  #: phases of level flight
LEAST_WINDOWS = 12  #: stretches without an edge, for the scatter; chosen
WINDOW_STEP = 20  #: samples from one such stretch to the next; chosen
#: weight of the diagonal in the scatter's covariance, whose stretches are few (shrinkage, Ledoit and Wolf 2004); chosen
SHRINKAGE = 0.3
#: speed (m/s) and seconds of a crossing where a log does not show them; chosen
USUAL_MPS, USUAL_S = 0.3, 2.5
_MISSION = """
name = "edge-response"
[[platform]]
size_m = [{length}, 4.0]
centre_m = [{centre}, 0.0]
top_m = {top}
[mission]
control = "velocity"
step = [{{ do = "wait", time_s = 0.5 }}, {{ do = "take-off", height_m = {height} }}, {{ do = "hover", time_s = 3.0 }},
        {{ do = "go", distance_m = {way}, speed_mps = {speed} }}, {{ do = "hover", time_s = 1.0 }}, {{ do = "land" }}]
"""


@dataclass(frozen=True)
class EdgeFloor:
    """What nominal flights do at edges, and its scatter.

    nominal: mean response (COUNT,) by kind, from `counts` edges each; whiten (COUNT, COUNT): turns a deviation from it
    into independent standard normal numbers.
    """

    vehicle: Vehicle
    calibration: tuple[Active, ...]
    nominal: dict[str, np.ndarray]
    counts: dict[str, int]
    whiten: np.ndarray
    workspace: Workspace = field(default_factory=Workspace, init=False, compare=False, repr=False)


def edges_of(flight: Flight) -> list[Edge]:
    """Edges with enough flight around them, none where there is no down range."""
    if not flight.log.has("zrange_m"):
        return []
    air = flight.phase != 0
    return flight.workspace.once("edges", (), lambda: [
        e for e in true_edges(flight.log, PLATFORM_STEP_M)
        if BEFORE <= e.sample < len(flight) - AFTER and air[e.sample - BEFORE:e.sample + AFTER].all()])


def response(log: FlightLog, vehicle: Vehicle, turn: np.ndarray | None, at: int) -> np.ndarray:
    """Thrust (N per motor), speed (m/s) and height (m) after sample `at`, less those before it, (COUNT,)."""
    window = slice(at - BEFORE, at + AFTER)
    thrust = vehicle.thrust(motion.interpolate_missing(log.stack(PWM)[window])).mean(axis=1)
    if log.has(*VELOCITY[:2]):
        speed = motion.interpolate_missing(log.stack(VELOCITY[:2])[window])
        heading = speed[:BEFORE].mean(axis=0)
        speed = speed @ (heading / max(float(np.hypot(*heading)), 1e-6))
    else:
        speed = np.zeros(BEFORE + AFTER)
    if log.has(POSITION[2]):
        height = motion.interpolate_missing(log[POSITION[2]][window])
    elif log.has("zrange_m"):
        height = motion.interpolate_missing(log["zrange_m"][window])
        step = np.diff(height, prepend=height[0])
        step[np.abs(step) > 0.5 * PLATFORM_STEP_M] = 0.0
        height = np.cumsum(step)
    else:
        height = np.zeros(BEFORE + AFTER)
    out = []
    for values, (width, n) in zip((thrust, speed, height), BINS, strict=True):
        size = int(round(width / PERIOD_S))
        values = values - values[:BEFORE - 3].mean()
        out.append(values[BEFORE:BEFORE + n * size].reshape(n, size).mean(axis=1))
    return np.concatenate(out)


def edge_floor_of(flights: Sequence[Flight], vehicle: Vehicle, calibration: Sequence[Active]) -> EdgeFloor | None:
    """Mean response and scatter of flights declared nominal; None where they cross no edge."""
    responses: dict[str, list[np.ndarray]] = {k: [] for k in KINDS}
    without_edge: list[np.ndarray] = []
    for f in flights:
        edges = edges_of(f)
        for e in edges:
            responses[e.kind].append(response(f.log, vehicle, f.turn, e.sample))
        without_edge += [response(f.log, vehicle, f.turn, at) for at in _without_edge(f, edges)]
    if not all(responses.values()) or len(without_edge) < LEAST_WINDOWS:
        return None
    covariance = _covariance(np.array(without_edge), responses)
    return EdgeFloor(vehicle, tuple(calibration), {k: np.mean(v, axis=0) for k, v in responses.items()},
                     {k: len(v) for k, v in responses.items()}, np.linalg.inv(np.linalg.cholesky(covariance)))


def _without_edge(flight: Flight, edges: Sequence[Edge]) -> list[int]:
    """Samples of level flight that have no edge near them, WINDOW_STEP apart."""
    level = np.isin(flight.phase, LEVEL)
    return [at for at in range(BEFORE, len(flight) - AFTER, WINDOW_STEP) if level[at - BEFORE:at + AFTER].all()
            and not any(-AFTER < e.sample - at < BEFORE + AFTER for e in edges)]


def _covariance(without_edge: np.ndarray, at_edges: dict[str, list[np.ndarray]]) -> np.ndarray:
    """Covariance (COUNT, COUNT) of a response: of stretches without an edge, and what edges scatter beyond them.

    without_edge: responses (stretches, COUNT); at_edges: those of each kind of edge.
    """
    spread = np.cov((without_edge - np.mean(without_edge, axis=0)).T)
    out = ((1.0 - SHRINKAGE) * spread + SHRINKAGE * np.diag(np.diag(spread))
           + 1e-12 * np.eye(COUNT) * max(np.trace(spread), 1e-9))
    deviations = np.array([x - np.mean(v, axis=0) for v in at_edges.values() if len(v) > 1 for x in v])
    if len(deviations):
        own = deviations.T @ deviations / max(sum(len(v) - 1 for v in at_edges.values()), 1)
        out += np.diag(np.maximum(np.diag(own) - np.diag(spread), 0.0))
    return out


def whitened(floor: EdgeFloor, flight: Flight, edge: Edge) -> np.ndarray:
    """Response of one edge less the nominal one, whitened by its scatter, (COUNT,)."""
    raw = response(flight.log, floor.vehicle, flight.turn, edge.sample) - floor.nominal[edge.kind]
    return floor.whiten @ raw / np.sqrt(1.0 + 1.0 / floor.counts[edge.kind])


def template(floor: EdgeFloor, flight: Flight, effect: str, parameter: str) -> dict[str, np.ndarray]:
    """Whitened response (COUNT,) by kind that one natural step of an effect's parameter adds."""
    place = _place(flight)

    def make() -> dict[str, np.ndarray]:
        term = terms(effect)[0]
        step = term.step(parameter)
        neutral = term.effect.scaled(term.effect.values(), 0.0)
        stepped = {**neutral, parameter: neutral[parameter] + step}
        base = _simulated_responses(floor, place, ())
        with_effect = _simulated_responses(floor, place, (Active(term.effect, stepped),))
        return {k: floor.whiten @ (with_effect[k] - base[k]) / np.sqrt(1.0 + 1.0 / floor.counts[k]) for k in KINDS}

    return floor.workspace.once("templates", (effect, parameter, place), make)


def expected(floor: EdgeFloor, flight: Flight, edge: Edge, active: Sequence[Active]) -> np.ndarray:
    """Whitened response (COUNT,) that effects add to one edge, in proportion to their parameters."""
    total = np.zeros(COUNT)
    for a in active:
        if not signature_of(a.effect).at_edges:
            continue
        term = terms(a.effect.name)[0]
        for name, amount in zip(term.free, term.scaled(a.values), strict=True):
            if amount:
                total += amount * template(floor, flight, a.effect.name, name)[edge.kind]
    return total


def _place(flight: Flight) -> tuple[float, float, float, float]:
    """Height and clearance (m), speed (m/s) and length (m) of crossing, rounded so that flights share a simulation."""
    edges = edges_of(flight)
    if not edges:
        raise ValueError(f"{flight.name}: no edge in this flight")
    entry = next((e for e in edges if e.kind == "entry"), None)
    leave = next((e for e in edges if e.kind == "exit" and (entry is None or e.sample > entry.sample)), None)
    edge = entry or leave or edges[0]
    high, low = max(edge.height_before_m, edge.height_after_m), min(edge.height_before_m, edge.height_after_m)
    speed = USUAL_MPS
    if flight.log.has(*VELOCITY[:2]):
        v = motion.interpolate_missing(flight.log.stack(VELOCITY[:2])[edge.sample - BEFORE:edge.sample + BEFORE])
        speed = float(np.hypot(*v.mean(axis=0)))
    seconds = (leave.sample - entry.sample) * PERIOD_S if entry and leave else USUAL_S
    speed = float(np.clip(speed, 0.1, 0.9))
    length = float(np.clip(seconds * speed, 0.4, 2.0))
    return round(high, 1), round(max(low, 0.01), 2), round(speed, 1), round(length, 1)


def calm(vehicle: Vehicle) -> Vehicle:
    """The vehicle with sensors that hardly err, so that an effect shows after an exit too.

    The exit comes at another time with the effect. Some flow noise stays, as the firmware's estimator drops the
    smallest corrections of its attitude.
    """
    return replace(vehicle, acc_noise_rms_mps2=0.0, gyro_noise_rms_radps=0.0, range_noise_rms_m=0.0,
                   range_drift_rms=0.0, flow_noise_mps=(0.02, 0.02), flow_noise_time_s=0.02)


def _simulated_responses(floor: EdgeFloor, place: tuple[float, float, float, float], active: Sequence[Active],
           ) -> dict[str, np.ndarray]:
    """Response (COUNT,) by kind of simulated flights over the same edges, in calm air; cached."""
    key = (place, tuple((a.effect.name, tuple(a.values.items())) for a in active))
    return floor.workspace.once("flown", key, lambda: _simulate(floor, place, active))


def _simulate(floor: EdgeFloor, place: tuple[float, float, float, float], active: Sequence[Active],
               ) -> dict[str, np.ndarray]:
    """Mean response (COUNT,) by kind of two flights over a platform; 0 for a kind that neither crosses."""
    height, low, speed, length = place
    text = _MISSION.format(length=length, centre=1.5 + 0.5 * length, top=max(height - low, 0.02), height=height,
                           way=1.5 + length + 1.5 * speed + 0.3, speed=speed)
    logs = [x for x in simulated(scenario.parse(text, "edge response"), 2, vehicle=calm(floor.vehicle),
                                 effects=[*floor.calibration, *active], workers=1) if isinstance(x, FlightLog)]
    responses: dict[str, list[np.ndarray]] = {k: [] for k in KINDS}
    for log in logs:
        for e in true_edges(log, min(PLATFORM_STEP_M, 0.5 * (height - low))):
            if BEFORE <= e.sample < len(log) - AFTER:
                responses[e.kind].append(response(log, floor.vehicle, None, e.sample))
    return {k: np.mean(v, axis=0) if v else np.zeros(COUNT) for k, v in responses.items()}
