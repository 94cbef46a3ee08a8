"""What effects add to the responses at edges, from the simulator: flown with and without them over such a platform.

The response to a parameter is that to one natural step of it, scaled: linear, as the steps are small.
"""

from collections.abc import Sequence
from dataclasses import replace
from importlib import resources
from typing import NamedTuple

import numpy as np

from airtouch.gap.edges.edge_response import AFTER, BEFORE, COUNT, KINDS, EdgeFloor, edges_of, logged, response
from airtouch.gap.flights.flight import PERIOD_S, Flight
from airtouch.gap.flights.missing import interpolate_missing
from airtouch.gap.signatures.candidates import terms
from airtouch.gap.signatures.signature import signature_of
from airtouch.logs.edges import Edge, true_edges
from airtouch.logs.flight_log import VELOCITY, FlightLog
from airtouch.logs.segments import PLATFORM_STEP_M
from airtouch.simulation import scenario
from airtouch.simulation.batch import flights as simulated
from airtouch.simulation.effects import Active
from airtouch.vehicle import Vehicle

#: speed (m/s) and seconds of a crossing where a log does not show them; chosen
ASSUMED_MPS, ASSUMED_CROSSING_S = 0.3, 2.5
SPEEDS_MPS, LENGTHS_M = (0.1, 0.9), (0.4, 2.0)  #: of simulated crossings: what such missions can fly; chosen
LEAST_CLEARANCE_M = 0.01  #: of simulated crossings; chosen
#: m from take-off to the platform, and beyond it at the end; s that the vehicle takes to stop; chosen
AHEAD_M, BEYOND_M, STOPPING_S = 1.5, 0.3, 1.5
#: m/s and s, rms and correlation time of the flow sensor's noise that stays; chosen
FLOW_NOISE_MPS, FLOW_NOISE_S = 0.02, 0.02
LEAST_TOP_M = 0.02  #: height of a simulated platform at least; chosen


class Crossing(NamedTuple):
    """A flight's way over a platform, rounded so that flights share a simulation.

    height_m: over the floor; clearance_m: over the platform, both to 10 mm, as the responses are in proportion to the
    platform's height, their difference; speed_mps; length_m: of the platform along the way.
    """

    height_m: float
    clearance_m: float
    speed_mps: float
    length_m: float


def added_response(floor: EdgeFloor, flight: Flight, edge: Edge, active: Sequence[Active]) -> np.ndarray:
    """Whitened response (COUNT,) that effects add to one edge, in proportion to their parameters."""
    total = np.zeros(COUNT)
    for a in active:
        if not signature_of(a.effect).at_edges:
            continue
        term = terms(a.effect.name)[0]
        for name, amount in zip(term.free, term.scaled(a.values), strict=True):
            if amount:
                total += amount * response_per_step(floor, flight, a.effect.name, name)[edge.kind]
    return total


def response_per_step(floor: EdgeFloor, flight: Flight, effect: str, parameter: str) -> dict[str, np.ndarray]:
    """Whitened response (COUNT,) by kind that one natural step of an effect's parameter adds.

    0 for a kind of which no edge was simulated, with the step or without: of it the simulator says nothing.
    """
    crossing = crossing_of(flight)

    def make() -> dict[str, np.ndarray]:
        """The difference of simulated flights with one natural step and without."""
        term = terms(effect)[0]
        step = term.step(parameter)
        neutral = term.effect.scaled(term.effect.values(), 0.0)
        stepped = {**neutral, parameter: neutral[parameter] + step}
        base = _simulated_responses(floor, crossing, ())
        with_effect = _simulated_responses(floor, crossing, (Active(term.effect, stepped),))
        return {k: floor.whiten(with_effect[k] - base[k], flight.log, k) if k in base and k in with_effect
                else np.zeros(COUNT) for k in KINDS}

    return floor.workspace.cached("templates", (effect, parameter, crossing, logged(flight.log).tobytes()), make)


def crossing_of(flight: Flight) -> Crossing:
    """The flight's first way over a platform; what the log does not show of it is ASSUMED_MPS or ASSUMED_CROSSING_S."""
    edges = edges_of(flight)
    if not edges:
        raise ValueError(f"{flight.name}: no edge in this flight")
    entry = next((e for e in edges if e.kind == "entry"), None)
    leave = next((e for e in edges if e.kind == "exit" and (entry is None or e.sample > entry.sample)), None)
    edge = entry or leave or edges[0]
    high, low = max(edge.height_before_m, edge.height_after_m), min(edge.height_before_m, edge.height_after_m)
    speed = ASSUMED_MPS
    if flight.log.has(*VELOCITY[:2]):
        v = interpolate_missing(flight.log.stack(VELOCITY[:2])[edge.sample - BEFORE:edge.sample + BEFORE])
        speed = float(np.hypot(*v.mean(axis=0)))
    seconds = (leave.sample - entry.sample) * PERIOD_S if entry and leave else ASSUMED_CROSSING_S
    speed = float(np.clip(speed, *SPEEDS_MPS))
    length = float(np.clip(seconds * speed, *LENGTHS_M))
    return Crossing(round(high, 2), round(max(low, LEAST_CLEARANCE_M), 2), round(speed, 1), round(length, 1))


def exact_sensors(vehicle: Vehicle) -> Vehicle:
    """The vehicle with sensors that hardly err, so that an effect shows after an exit too.

    The exit comes at another time with the effect. Some flow noise stays, as the firmware's estimator drops the
    smallest corrections of its attitude.
    """
    return replace(vehicle, acc_noise_rms_mps2=0.0, gyro_noise_rms_radps=0.0, range_noise_rms_m=0.0,
                   range_drift_rms=0.0, flow_noise_mps=(FLOW_NOISE_MPS, FLOW_NOISE_MPS),
                   flow_noise_time_s=FLOW_NOISE_S)


def _simulated_responses(floor: EdgeFloor, crossing: Crossing, active: Sequence[Active],
                         ) -> dict[str, np.ndarray]:
    """Response (COUNT,) of simulated flights over the same edges in calm air, by kind as of `_simulate`; cached."""
    key = (crossing, tuple((a.effect.name, tuple(a.values.items())) for a in active))
    return floor.workspace.cached("flown", key, lambda: _simulate(floor, crossing, active))


def _simulate(floor: EdgeFloor, crossing: Crossing, active: Sequence[Active]) -> dict[str, np.ndarray]:
    """Mean response (COUNT,) of the edges of two flights over a platform, by kind; without a kind that has none."""
    height, clearance, speed, length = crossing
    values = {"length": length, "centre": AHEAD_M + 0.5 * length, "top": max(height - clearance, LEAST_TOP_M),
              "height": height, "way": AHEAD_M + length + STOPPING_S * speed + BEYOND_M, "speed": speed}
    text = (resources.files("airtouch") / "gap/edges/edge-response.toml").read_text("utf-8")
    text += "[values]\n" + "".join(f"{name} = {value}\n" for name, value in values.items())
    logs = [x for x in simulated(scenario.parse(text, "edge response"), 2, vehicle=exact_sensors(floor.vehicle),
                                 effects=[*floor.calibration, *active], workers=1) if isinstance(x, FlightLog)]
    responses: dict[str, list[np.ndarray]] = {k: [] for k in KINDS}
    for log in logs:
        for e in true_edges(log, min(PLATFORM_STEP_M, 0.5 * (height - clearance))):
            if BEFORE <= e.sample < len(log) - AFTER:
                responses[e.kind].append(response(log, floor.vehicle, e.sample))
    return {k: np.mean(v, axis=0) for k, v in responses.items() if v}
