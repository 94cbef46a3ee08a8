"""A vehicle in flight that is flown any number of rows at a time, with set-points as they come."""

from collections.abc import Sequence

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.simulation import effects as registry
from airtouch.simulation import kept, loop
from airtouch.simulation.effects import Active
from airtouch.simulation.effects.effect import PARAMETERS, Wrenches
from airtouch.simulation.plant import from_vehicle, hover_pwm, hover_speed
from airtouch.simulation.random_stream import stream
from airtouch.simulation.scenario import FlightPlan
from airtouch.vehicle import Vehicle

MOST_HOVER_PWM = 62000  #: of 65535; the rest is what attitude control needs


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


class Stepper:
    """One flight's plant, world, effects and random numbers, and what it keeps between rows.

    `plant` (1,) and `memory` (1,) of kept.MEMORY_DTYPE may be looked at and changed between calls.
    """

    def __init__(self, plan: FlightPlan, vehicle: Vehicle, seed: int, flight: int,
                 active: Sequence[Active]) -> None:
        """As the flight of that number is drawn. AirTouchError for a vehicle that cannot lift itself."""
        vehicle = plan.flown_by(vehicle)
        if hover_pwm(vehicle) > MOST_HOVER_PWM:
            raise AirTouchError(f"{vehicle.name} cannot lift itself: hover needs PWM "
                                f"{hover_pwm(vehicle):.0f}")
        self.plant, acting = prepare(vehicle, active)
        self._gain = self.plant[0]["gain"].copy()  # the loop writes gain times noise into the plant
        self.world, self.room = plan.world, plan.room
        self.used = len(acting)
        self.functions = Wrenches([a.effect.wrench for a in acting], loop.SLOTS)
        self.parameters = np.zeros((loop.SLOTS, PARAMETERS))
        self.effect_streams = np.zeros((loop.SLOTS, 1), np.uint64)
        seen: dict[str, int] = {}
        for i, a in enumerate(acting):
            self.parameters[i] = a.effect.vector(a.values)
            seen[a.effect.name] = seen.get(a.effect.name, 0) + 1
            self.effect_streams[i] = stream(seed, flight, f"{a.effect.name}/{seen[a.effect.name]}")
        self.streams = np.array([stream(seed, flight, n) for n in ("motors", "imu", "ranging", "start")])
        self.memory = kept.memory()

    def begin(self, setpoint: np.ndarray) -> None:
        """Stand on what is below the set-point (8,), motors off."""
        w = self.world
        self.memory[:] = 0
        self.plant[0]["gain"] = self._gain
        kept.begin(self.plant, w.corners, w.first, w.surface, w.box, setpoint, self.streams[3], self.memory)

    def fly(self, setpoints: np.ndarray, table: np.ndarray) -> tuple[int, int]:
        """Fly on by len(table) rows into table (rows, 33): how it ended, rows filled. setpoints (rows, 8)."""
        w = self.world
        return loop.fly(self.plant, w.corners, w.first, w.surface, w.box, self.room, setpoints,
                        self.functions, self.used, self.parameters, self.effect_streams, self.streams,
                        self.memory, table)
