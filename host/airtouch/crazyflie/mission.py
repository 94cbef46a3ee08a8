"""Missions: the [mission] of a scenario file as legs for the high-level commander.

The simulator and the drone fly the same file: way-points, speeds and times come from the simulator's
set-points.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError, nearest
from airtouch.simulation import scenario
from airtouch.simulation.firmware import setpoint as c
from airtouch.simulation.flight_plan.mission import RATE_HZ

SHORTEST_S = 0.05  #: s; a shorter stop is a corner, no hover
LEVEL_M = 1e-3  #: m; a leg that ends so near to its first height is level
LANDING_MPS = 0.3  #: m/s; assumed, within the firmware's range for landings
LEAST_LANDING_S = 2.0  #: s, shortest landing


@dataclass(frozen=True)
class Leg:
    """A leg: kind (wait, take-off, go, hover or land), its end (m, rad) and its duration (s).

    Positions are relative to the position and heading at take-off: x forward, y left, z up.
    """

    kind: str
    x_m: float
    y_m: float
    z_m: float
    seconds: float


@dataclass(frozen=True)
class Mission:
    """A mission: its legs, the values drawn for it, and its scenario."""

    name: str
    legs: tuple[Leg, ...]
    values: dict
    speed_mps: float | None  #: speed of the longest level leg; scores use it

    @property
    def seconds(self) -> float:
        """Duration from the start of the log to the stop of the motors."""
        return sum(leg.seconds for leg in self.legs)

    @property
    def room_m(self) -> tuple[float, float, float, float, float]:
        """Least x, greatest x, least y, greatest y, greatest height."""
        x, y, z = ([0.0, *(getattr(leg, a) for leg in self.legs)] for a in ("x_m", "y_m", "z_m"))
        return min(x), max(x), min(y), max(y), max(z)

    def describe(self) -> str:
        """One line with the legs and the room that they need."""
        speed = f", {self.speed_mps:g} m/s" if self.speed_mps else ""
        return f"{self.name}: {self.seconds:.0f} s{speed}; {_room_in_words(self.room_m)}"


def describe_all(missions: Sequence[Mission]) -> str:
    """One line with the room that all flights of a mission need, whose drawn values differ."""
    if len(missions) == 1:
        return missions[0].describe()
    x0, x1, y0, y1, z1 = zip(*(one.room_m for one in missions), strict=True)
    whole = _room_in_words((min(x0), max(x1), min(y0), max(y1), max(z1)))
    return f"{missions[0].name}: {len(missions)} flights; the room of all of them: {whole}"


def _room_in_words(room_m: tuple[float, float, float, float, float]) -> str:
    x0, x1, y0, y1, z1 = room_m
    return f"x {x0:.1f} to {x1:.1f} m ahead, y {y0:.1f} to {y1:.1f} m to the left, up to {z1:.2f} m high"


def names() -> list[str]:
    """Names of the missions in the package."""
    return scenario.names(scenario.MISSIONS)


def load(name_or_path: str | Path, seed: int = 0, flight: int = 0) -> Mission:
    """A mission by the name of a built-in mission or scenario, or by .toml file; seed and flight draw its values.

    Raises AirTouchError, in one line, for a file that cannot be read and a mission that cannot be flown.
    """
    scene = scene_of(name_or_path)
    plan = scenario.draw_flight(scene, seed, flight)
    legs = legs_of(plan.setpoints)
    before = [0.0, *(leg.z_m for leg in legs)]
    level = [(leg.seconds, speed) for leg, speed, z_m in zip(legs, _speeds(legs), before, strict=False)
             if leg.kind == "go" and abs(leg.z_m - z_m) < LEVEL_M]
    return Mission(scene.name, tuple(legs), plan.values, round(max(level)[1], 4) if level else None)


def scene_of(name_or_path: str | Path) -> scenario.Scenario:
    """`scenario.load`, whose error for an unknown name is that there is no such mission, with similar names."""
    known = [*names(), *scenario.names()]
    if Path(name_or_path).suffix != ".toml" and str(name_or_path) not in known:
        near = nearest(str(name_or_path), known)
        raise AirTouchError(f"no mission {str(name_or_path)!r}{near} (ready ones: {', '.join(names())}, or a .toml "
                            "file)")
    return scenario.load(name_or_path)


def legs_of(setpoints: np.ndarray) -> list[Leg]:
    """The legs of set-points (rows, 8) at 100 Hz: one for each interval of constant motion.

    A landing is added to a flight without one.
    """
    rows = np.asarray(setpoints, dtype=np.float64)
    places, motors = rows[:, c.X:c.Z + 1], rows[:, c.MOTORS] > 0.0
    steps = np.diff(places, axis=0, prepend=2 * places[:1] - places[1:2])
    changed = (np.abs(np.diff(steps, axis=0)) > 1e-7).any(axis=1) | (np.diff(motors.astype(int)) != 0)
    bounds = np.r_[0, np.flatnonzero(changed) + 1, len(rows)]
    local = _at_start(places, rows[0, c.YAW])
    legs: list[Leg] = []
    flying = False
    for first, stop in zip(bounds[:-1], bounds[1:], strict=True):
        seconds = (stop - first) / RATE_HZ
        end, step = local[stop - 1], steps[stop - 1]
        if not motors[stop - 1]:
            legs.append(_leg("wait", (end[0], end[1], 0.0), seconds))
            flying = False
            continue
        kind = "go" if np.abs(step).max() > 1e-9 else "hover"
        if not flying:
            kind, flying = "take-off", True
        elif kind == "hover" and seconds < SHORTEST_S:
            continue
        elif stop < len(rows) and not motors[stop]:
            kind, end = "land", (end[0], end[1], 0.0)
        legs.append(_leg(kind, end, seconds))
    if legs and flying:
        legs.append(landing(legs[-1]))
    return legs


def _leg(kind: str, end: Sequence[float], seconds: float) -> Leg:
    x, y, z = (round(float(v), 6) for v in end)
    return Leg(kind, x, y, z, float(seconds))


def landing(last: Leg) -> Leg:
    """A landing straight down from the end of a leg."""
    return replace(last, kind="land", z_m=0.0, seconds=landing_seconds(last.z_m))


def landing_seconds(height_m: float) -> float:
    """The duration (s) of a landing from this height over the take-off: 0.3 m/s on average, 2 s at least."""
    return max(LEAST_LANDING_S, height_m / LANDING_MPS)


def _at_start(places: np.ndarray, yaw: float) -> np.ndarray:
    """World positions (n, 3) relative to the start, with x along the heading there."""
    moved = places - places[0]
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.column_stack([cos * moved[:, 0] + sin * moved[:, 1], cos * moved[:, 1] - sin * moved[:, 0],
                            moved[:, 2]])


def _speeds(legs: Sequence[Leg]) -> list[float]:
    """Horizontal speed of each leg, m/s."""
    before = [Leg("wait", 0.0, 0.0, 0.0, 0.0), *legs[:-1]]
    return [float(np.hypot(b.x_m - a.x_m, b.y_m - a.y_m)) / b.seconds
            for a, b in zip(before, legs, strict=True)]
