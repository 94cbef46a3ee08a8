"""Simulated flights of recorded courses, as features."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.flight_log import FlightLog
from airtouch.simulation import flight
from airtouch.simulation.flight import Diverged
from airtouch.twin.fitting import levers as lever_set
from airtouch.twin.fitting.levers import Lever
from airtouch.twin.recorded import missions
from airtouch.twin.recorded.course import Course, course
from airtouch.twin.recorded.features import features, names
from airtouch.vehicle import Vehicle


def fly(recorded: Course, vehicle: Vehicle, levers: Sequence[Lever], values: np.ndarray, seed: int, number: int,
        fixed: Mapping[str, Any] | None = None) -> FlightLog | Diverged:
    """The log of a recorded course, flown in the simulator with levers at values (levers,).

    number: of the flight, which with `seed` draws its noise. fixed: effects without levers.
    """
    effects = lever_set.table(levers, values, fixed)
    scene = missions.scenario_of(recorded, effects, missions.NAME, **lever_set.mission(levers, values))
    return flight.fly(scene, lever_set.craft(vehicle, levers, values), seed, number)


def simulated_course(log: FlightLog, recorded: Course) -> Course:
    """The course of a simulated flight, with speed and angle of the recorded one.

    Raises AirTouchError for a log without platform or free air.
    """
    return course(log, recorded.speed_mps, recorded.angle_deg)


def simulated_features(courses: Sequence[Course], vehicle: Vehicle, levers: Sequence[Lever], values: np.ndarray,
                       seed: int, first: int = 0, fixed: Mapping[str, Any] | None = None,
                       workers: int = 1) -> np.ndarray:
    """Features (flights, features) of simulated flights; flight i flies courses[i] with the levers at values[i].

    values: (flights, levers). first: number of the first flight. workers: threads. The row of a flight that diverges,
    or whose log shows no course, is NaN.
    """
    def features_of(i: int) -> np.ndarray:
        """Features (features,) of flight i."""
        log = fly(courses[i], vehicle, levers, values[i], seed, first + i, fixed)
        if isinstance(log, Diverged):
            return np.full(len(names()), np.nan)
        try:
            return features(log, simulated_course(log, courses[i]))
        except AirTouchError:
            return np.full(len(names()), np.nan)

    if workers == 1:
        return np.array([features_of(i) for i in range(len(courses))])
    with ThreadPoolExecutor(workers) as pool:
        return np.array(list(pool.map(features_of, range(len(courses)))))
