"""A vehicle in flight that is flown any number of rows at a time, with set-points as they come."""

from collections.abc import Sequence

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.simulation import effects as registry
from airtouch.simulation import loop
from airtouch.simulation import state as states
from airtouch.simulation.body import motors
from airtouch.simulation.effects import Active
from airtouch.simulation.effects.slots import slots
from airtouch.simulation.plant import from_vehicle, hover_pwm, hover_speed
from airtouch.simulation.random_generator import generator
from airtouch.simulation.scenario import FlightPlan
from airtouch.simulation.sensors import imu, ranging
from airtouch.vehicle import Vehicle

MOST_HOVER_PWM = 62000  #: of 65535; the rest is what attitude control needs


def prepare(vehicle: Vehicle, active: Sequence[Active]) -> tuple[np.ndarray, list[Active]]:
    """The plant (1,) with the settings of the effects, and the effects that act in flight.

    The vehicle's own rotor drag flies as the effect of that name.
    """
    plant = from_vehicle(vehicle)
    for a in active:
        if a.effect.settings is not None:
            a.effect.settings(plant[0], a.values)
    acting = [a for a in active if a.effect.wrench is not None]
    if vehicle.rotor_drag_kg_per_rad > 0.0:  # per rotor speed; the effect's is at the hover speed of this plant
        drag = vehicle.rotor_drag_kg_per_rad * 4.0 * hover_speed(plant)
        acting += registry.activate({"rotor_drag": {"horizontal": drag}})
    return plant, acting


class Stepper:
    """One flight's plant, world, effects, random numbers and state, flown on by `fly`.

    `plant` (1,) of plant.DTYPE and `state` (1,) of state.DTYPE may be looked at and changed between calls.
    """

    def __init__(self, plan: FlightPlan, vehicle: Vehicle, seed: int, flight: int,
                 active: Sequence[Active]) -> None:
        """As the flight of that number is drawn. AirTouchError for a vehicle without lift and a delay too long."""
        vehicle = plan.with_changes(vehicle)
        if not hover_pwm(vehicle) <= MOST_HOVER_PWM:  # also where no PWM carries it, NaN
            raise AirTouchError(f"{vehicle.name} cannot lift itself: hover needs PWM "
                                f"{hover_pwm(vehicle):.0f}")
        self.plant, acting = prepare(vehicle, active)
        _check_delays(self.plant[0])
        self.state = states.empty()
        generators = np.zeros(1, loop.GENERATORS)
        for name in loop.GENERATORS.names or ():
            generators[0][name] = generator(seed, flight, name)
        effects = slots(acting, [generator(seed, flight, key) for key in keys(acting)])
        self.flight = loop.Flight(self.plant, plan.world, plan.room, effects, generators, self.state)

    def begin(self, setpoint: np.ndarray) -> None:
        """Stand on the surface below the set-point (8,), motors off."""
        self.state[:] = 0
        states.begin(self.plant, self.flight.world, setpoint, self.flight.generators[0]["start"], self.state)

    def fly(self, setpoints: np.ndarray, table: np.ndarray) -> tuple[int, int]:
        """Fly len(table) rows of setpoints (rows, 8) into table (rows, 33). Returns OK or a reason, and rows filled."""
        return loop.fly(self.flight, setpoints, table)


def _check_delays(row: np.void) -> None:
    """Raise AirTouchError for a delay that is longer than its delay line, which would hold a later value."""
    periods = row["firmware"]["periods"]
    longest_s = {
        "actuator_delay": (motors.DELAY_ROWS - 1) * row["step"],
        "sensor_delay": 0.001 * (imu.DELAY_ROWS - 2),  # two samples are taken a step
        "range_delay": 0.001 * (ranging.RANGES * periods["range_ms"] - 1),
        "flow_delay": 0.001 * (ranging.FLOWS - 1) * periods["flow_ms"],
    }
    for name, most in longest_s.items():
        if not 0.0 <= row[name] <= most:
            raise AirTouchError(f"{name} = {row[name]:g} s is not what the simulator can fly; give 0 to {most:g} s")


def keys(acting: Sequence[Active], first: str = "/1") -> list[str]:
    """Names of the effects' random generators: an effect that comes twice draws other numbers the second time.

    first: what follows the name of an effect that comes for the first time.
    """
    names = [a.effect.name for a in acting]
    times = [names[:i].count(name) + 1 for i, name in enumerate(names)]
    return [name + (first if time == 1 else f"/{time}") for name, time in zip(names, times, strict=True)]
