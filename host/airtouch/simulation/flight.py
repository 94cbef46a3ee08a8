"""Fly one flight of a scenario and give it as a flight log."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import COLUMNS, FlightLog
from airtouch.parameters import SAMPLE_RATE_HZ
from airtouch.simulation import effects as registry
from airtouch.simulation import loop
from airtouch.simulation.effects import Active
from airtouch.simulation.firmware import setpoint
from airtouch.simulation.scenario import FlightPlan, Scenario, draw_flight
from airtouch.simulation.sensors import log_row
from airtouch.simulation.sensors.radio import received, rounded
from airtouch.simulation.stepper import Stepper, prepare
from airtouch.vehicle import Vehicle

__all__ = ["Chosen", "Diverged", "choose", "fly", "fly_plan", "metadata", "prepare"]
PER_UNIT = 1e6  #: logged values are whole millionths of their SI units
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


def fly(scenario: Scenario, vehicle: Vehicle, seed: int = 0, flight: int = 0, *, effects: Chosen = (),
        without: Sequence[str] = ()) -> FlightLog | Diverged:
    """Fly flight number `flight` of a scenario. The result depends on the arguments only.

    effects: on top of the scenario's (one of the same name replaces it). without: names to
    leave out. Raises AirTouchError for what cannot be flown.
    """
    plan = draw_flight(scenario, seed, flight)
    return fly_plan(plan, vehicle, seed, flight, choose(plan, effects, without), scenario.name)


def choose(plan: FlightPlan, effects: Chosen = (), without: Sequence[str] = ()) -> list[Active]:
    """The effects of one flight: those of the scenario, with `effects` replaced or added and `without` removed."""
    for name in without:
        registry.get(name)
    chosen = registry.activate(effects)
    named = {a.effect.name for a in chosen}
    others = [(name, values) for name, values in plan.effects if name not in named]
    return [a for a in registry.activate([*others, *chosen]) if a.effect.name not in without]


def refuse_off(plan: FlightPlan, without: Sequence[str]) -> None:
    """Raise AirTouchError for the name of an effect that the flight's scenario does not switch on."""
    on = [name for name, _ in plan.effects]
    for name in without:
        registry.get(name)
        if name not in on:
            raise AirTouchError(f"--without {name}: this scenario does not switch it on"
                                + (f"; on are {', '.join(dict.fromkeys(on))}" if on else ", nor any other effect"))


def metadata(plan: FlightPlan, vehicle: Vehicle, seed: int, flight: int, active: Sequence[Active],
             name: str) -> dict[str, Any]:
    """What the log of a drawn flight says of it, but its `source`: vehicle and firmware, drawn values, effects."""
    vehicle = plan.with_changes(vehicle)
    return {
        "format": "simulated", "sample_period_s": 0.01, "acc_frame": "body",
        "vehicle": vehicle.name, "firmware": vehicle.firmware, "range_module": vehicle.range_module,
        "scenario": name, "seed": seed, "flight": flight, "condition": plan.values,
        "effects": [[a.effect.name, dict(a.values)] for a in active], "warnings": [],
    }


def fly_plan(plan: FlightPlan, vehicle: Vehicle, seed: int, flight: int, active: Sequence[Active],
             name: str) -> FlightLog | Diverged:
    """Fly a drawn flight with these effects."""
    vehicle = plan.with_changes(vehicle)
    stepper = Stepper(plan, vehicle, seed, flight, active)
    plant = stepper.plant
    table = np.empty((len(plan.setpoints), log_row.COLUMNS))
    radio = (float(plant[0]["time_jitter"]), float(plant[0]["packet_loss"]), float(plant[0]["loss_burst"]))
    stepper.begin(plan.setpoints[0])
    ending, rows = stepper.fly(plan.setpoints, table)
    if ending != loop.OK:
        return Diverged(name, seed, flight, loop.ENDINGS[ending], rows / SAMPLE_RATE_HZ)
    climb = plan.setpoints[:, setpoint.Z].max() - plan.setpoints[0, setpoint.Z]
    if np.ptp(table[:, log_row.POSITION + 2]) < 0.5 * climb:
        return Diverged(name, seed, flight, "it did not take off", len(table) / SAMPLE_RATE_HZ)
    rng = np.random.default_rng([seed, flight, 7])
    table = received(table, *radio, rng)
    rounded(table, PER_UNIT)
    meta = {"source": f"{name}_{seed}_{flight:06d}", **metadata(plan, vehicle, seed, flight, active, name)}
    return FlightLog({c: table[:, i] for i, c in enumerate(COLUMNS)}, meta)
