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


def fly(chosen: Course, vehicle: Vehicle, levers: Sequence[Lever], values: np.ndarray, seed: int, number: int,
        fixed: Mapping[str, Any] | None = None) -> FlightLog | Diverged:
    """The log of a recorded course, flown in the simulator with levers at values (levers,)."""
    effects = lever_set.table(levers, values, fixed)
    scene = missions.one(chosen, effects, missions.NAME, **lever_set.mission(levers, values))
    return flight.fly(scene, lever_set.craft(vehicle, levers, values), seed, number)


def simulated_course(log: FlightLog, chosen: Course) -> Course:
    """The course of a simulated flight, with the speed and angle that it was flown with."""
    return course(log, chosen.speed_mps, chosen.angle_deg)


def flown_features(courses: Sequence[Course], vehicle: Vehicle, levers: Sequence[Lever], values: np.ndarray,
                   seed: int, first: int = 0, fixed: Mapping[str, Any] | None = None, workers: int = 1) -> np.ndarray:
    """Features (flights, features) of simulated flights; flight i flies courses[i] with the levers values[i].

    The row of a flight that diverges is NaN.
    """
    def features_of(i: int) -> np.ndarray:
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
