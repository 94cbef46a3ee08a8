"""Fly one flight of a scenario and give it as a flight log."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import COLUMNS, FlightLog
from airtouch.simulation import controller, loop
from airtouch.simulation import effects as registry
from airtouch.simulation.effects import Active
from airtouch.simulation.effects.effect import PARAMETERS, wrench
from airtouch.simulation.plant import from_vehicle, hover_pwm, hover_speed
from airtouch.simulation.radio import received
from airtouch.simulation.random_stream import stream
from airtouch.simulation.scenario import FlightPlan, Scenario, draw_flight
from airtouch.vehicle import Vehicle

MOST_HOVER_PWM = 62000  #: of 65535; the rest is what attitude control needs
DECIMALS = 6  #: of logged values, in their SI units
Chosen = Mapping[str, Mapping[str, float]] | Sequence[Any]


@dataclass(frozen=True)
class Diverged:
    """A flight that did not end well: never a log. `reason` says how, `time_s` when."""

    scenario: str
    seed: int
    flight: int
    reason: str
    time_s: float

    def __str__(self) -> str:
        return (f"{self.scenario}, seed {self.seed}, flight {self.flight}: {self.reason} "
                f"after {self.time_s:.2f} s; not written")


@wrench
def _nothing(p, s, memory, stream, out):
    pass


def fly(scenario: Scenario, vehicle: Vehicle, seed: int = 0, flight: int = 0, *, effects: Chosen = (),
        without: Sequence[str] = ()) -> FlightLog | Diverged:
    """Flight number `flight` of a scenario: depends on the arguments only.

    effects: on top of the scenario's (one of the same name replaces it). without: names to
    leave out. Raises AirTouchError for what cannot be flown.
    """
    plan = draw_flight(scenario, seed, flight)
    return fly_plan(plan, vehicle, seed, flight, choose(plan, effects, without), scenario.name)


def choose(plan: FlightPlan, effects: Chosen = (), without: Sequence[str] = ()) -> list[Active]:
    """The effects of one flight: the scenario's, replaced or joined by `effects`, less `without`."""
    for name in without:
        registry.get(name)
    added = registry.activate(effects)
    named = {a.effect.name for a in added}
    kept = [(name, values) for name, values in plan.effects if name not in named]
    return [a for a in registry.activate([*kept, *added]) if a.effect.name not in without]


def prepare(vehicle: Vehicle, active: Sequence[Active]) -> tuple[np.ndarray, list[Active]]:
    """The plant (1,) with the settings of the effects, and the effects that act in flight.

    The vehicle's own rotor drag flies as the effect of that name.
    """
    plant = from_vehicle(vehicle)
    acting = [a for a in active if a.effect.wrench is not None]
    if vehicle.rotor_drag_kg_per_rad > 0.0:
        drag = vehicle.rotor_drag_kg_per_rad * 4.0 * hover_speed(plant)
        acting += registry.activate({"rotor_drag": {"horizontal": drag}})
    for a in active:
        if a.effect.settings is not None:
            a.effect.settings(plant[0], a.values)
    if len(acting) > loop.SLOTS:
        raise AirTouchError(f"{len(acting)} effects with a force at once; at most {loop.SLOTS}")
    return plant, acting


def fly_plan(plan: FlightPlan, vehicle: Vehicle, seed: int, flight: int, active: Sequence[Active],
             name: str) -> FlightLog | Diverged:
    """Fly a drawn flight with these effects."""
    if hover_pwm(vehicle) > MOST_HOVER_PWM:
        raise AirTouchError(f"{vehicle.name} cannot lift itself: hover needs PWM {hover_pwm(vehicle):.0f}")
    plant, acting = prepare(vehicle, active)
    functions = tuple(a.effect.wrench for a in acting) + (_nothing,) * (loop.SLOTS - len(acting))
    parameters = np.zeros((loop.SLOTS, PARAMETERS))
    streams = np.zeros((loop.SLOTS, 1), np.uint64)
    seen: dict[str, int] = {}
    for i, a in enumerate(acting):
        parameters[i] = a.effect.vector(a.values)
        seen[a.effect.name] = seen.get(a.effect.name, 0) + 1
        streams[i] = stream(seed, flight, f"{a.effect.name}/{seen[a.effect.name]}")
    core = np.array([stream(seed, flight, n) for n in ("motors", "imu", "ranging", "start")])
    table = np.full((len(plan.setpoints), loop.COLUMNS), np.nan)
    radio = (float(plant[0]["time_jitter"]), float(plant[0]["packet_loss"]), float(plant[0]["loss_burst"]))
    w = plan.world
    ending, rows = loop.fly(plant, w.corners, w.first, w.surface, w.box, plan.room, plan.setpoints, functions,
                            len(acting), parameters, streams, core, table)
    if ending != loop.OK:
        return Diverged(name, seed, flight, loop.ENDINGS[ending], rows / 100.0)
    climb = plan.setpoints[:, controller.Z].max() - plan.setpoints[0, controller.Z]
    if np.ptp(table[:, loop.PLACE + 2]) < 0.5 * climb:
        return Diverged(name, seed, flight, "it did not take off", len(table) / 100.0)
    rng = np.random.default_rng([seed, flight, 7])
    table = np.round(received(table, *radio, rng), DECIMALS)
    meta = {
        "source": f"{name}_{seed}_{flight:06d}", "format": "simulated", "sample_period_s": 0.01,
        "acc_frame": "body",
        "vehicle": vehicle.name, "scenario": name, "seed": seed, "flight": flight, "condition": plan.values,
        "effects": [[a.effect.name, dict(a.values)] for a in active], "warnings": [],
    }
    return FlightLog({c: table[:, i] for i, c in enumerate(COLUMNS)}, meta)
