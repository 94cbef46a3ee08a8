"""From the steps of a mission to one set-point a logged row (100 Hz)."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.simulation.firmware import setpoint as c
from airtouch.simulation.flight_plan.world import NONE, World, first_below, top_at
from airtouch.tables import number, number_list, table_list

RATE_HZ = 100  #: rows of set-points a second, as a client sends them
MAX_SPEED_MPS = 1.0  #: the firmware's own limit (PID_POS_VEL_X_MAX)
KEYS = {
    "wait": {"time_s"}, "take-off": {"height_m", "time_s"}, "hover": {"time_s", "pulse_mps", "every_s"},
    "go": {"to_m", "distance_m", "direction_deg", "height_m", "speed_mps"},
    "zigzag": {"size_m", "spacing_m", "speed_mps"}, "land": {"time_s"},
}
NEEDED = {"take-off": {"height_m"}, "hover": {"time_s"}, "wait": {"time_s"}, "go": {"speed_mps"},
          "zigzag": {"size_m", "spacing_m", "speed_mps"}}
MAX_FLIGHT_S = 3600.0  #: a longer time is a typing error; a battery lasts 7 minutes
PULSE_ROWS = 2  #: set-point rows of a velocity pulse in hover: 20 ms, as of the authors' pilot program


class _Pen:
    """Draws set-points row after row."""

    def __init__(self, start: Sequence[float], yaw_rad: float, position: bool, world: World) -> None:
        self.rows: list[np.ndarray] = []
        self.world = world
        self.at = np.array([start[0], start[1], self.top(start)])
        self.yaw, self.position = yaw_rad, position
        self.motors = 0.0

    def top(self, place: Sequence[float] | np.ndarray) -> float:
        """Height of the surface at (x, y), m."""
        return top_at(self.world, place[0], place[1])

    def move(self, to: np.ndarray, seconds: float) -> None:
        n = max(int(round(seconds * RATE_HZ)), 1)
        share = np.arange(1, n + 1)[:, None] / n
        places = self.at + share * (to - self.at)
        block = np.zeros((n, c.SETPOINT_SIZE))
        block[:, c.MODE] = float(self.position)
        block[:, c.X:c.Z + 1] = places
        block[:, c.VX:c.VY + 1] = (to - self.at)[:2] * RATE_HZ / n
        block[:, c.YAW], block[:, c.MOTORS] = self.yaw, self.motors
        self.rows.append(block)
        self.at = to.copy()

    @property
    def count(self) -> int:
        return sum(len(r) for r in self.rows)


def setpoints(mission: Mapping[str, Any], world: World, where: str) -> np.ndarray:
    """Set-points (rows, 8) of a mission whose values are drawn.

    mission: start_m, yaw_deg, control ("velocity" as the paper's flights, or "position"),
    step: a list of tables with `do`. Raises AirTouchError for unknown, missing or contradicting keys, for a mission
    without take-off, for a path of the set-points through a surface (the vehicle's size is left out, and so are
    take-off and landing) and for speeds, climb and pulses among them, beyond the firmware's limit.
    """
    unknown = set(mission) - {"start_m", "yaw_deg", "control", "step"}
    if unknown:
        raise AirTouchError(f"{where}: mission has no key {', '.join(sorted(unknown))}")
    control = mission.get("control", "velocity")
    if control not in ("velocity", "position"):
        raise AirTouchError(f"{where}: control is velocity or position, not {control!r}")
    start = number_list(mission, "start_m", where, 2, default=(0.0, 0.0))
    pen = _Pen(start, math.radians(number(mission, "yaw_deg", where, default=0.0)), control == "position", world)
    steps = table_list({"mission.step": mission.get("step", [])}, "mission.step", where)
    if not steps:
        raise AirTouchError(f"{where}: a mission needs steps")
    for i, step in enumerate(steps):
        place = f"{where}: step {i + 1}"
        kind = step.get("do")
        if not isinstance(kind, str) or kind not in KEYS:
            raise AirTouchError(f"{place}: no step {kind!r}; known: {', '.join(KEYS)}")
        wrong = set(step) - KEYS[kind] - {"do"}
        missing = NEEDED.get(kind, set()) - set(step)
        if wrong or missing:
            fault, keys = ("does not take", wrong) if wrong else ("needs", missing)
            raise AirTouchError(f"{place}: {kind} {fault} {', '.join(sorted(keys))}")
        _check_numbers(step, place)
        for key in ("speed_mps", "pulse_mps"):
            _check_speed(abs(step.get(key, 0.0)), place)
        first = pen.count
        _run(pen, kind, step, place)
        if pen.count > MAX_FLIGHT_S * RATE_HZ:
            raise AirTouchError(f"{place}: the flight is longer than {MAX_FLIGHT_S:g} s")
        if kind in ("hover", "go", "zigzag"):
            _check_path(pen, first, place)
    if not any(step["do"] == "take-off" for step in steps):
        raise AirTouchError(f"{where}: this mission never takes off")
    return np.ascontiguousarray(np.concatenate(pen.rows))


def _check_speed(mps: float, place: str, remedy: str = "") -> None:
    """Raise AirTouchError, with what to do, for a speed beyond the firmware's limit."""
    if mps > MAX_SPEED_MPS * (1.0 + 1e-9):  # but for rounding
        raise AirTouchError(f"{place}: {mps:g} m/s is faster than the firmware flies, {MAX_SPEED_MPS:g} m/s{remedy}")


def _check_go(step: Mapping[str, Any], place: str) -> None:
    """Raise AirTouchError for a `go` to two places or to none."""
    if "to_m" in step and ("distance_m" in step or "direction_deg" in step):
        raise AirTouchError(f"{place}: go takes to_m, or distance_m and direction_deg; not both")
    if "direction_deg" in step and "distance_m" not in step:
        raise AirTouchError(f"{place}: go with direction_deg needs distance_m")
    if not {"to_m", "distance_m", "height_m"} & set(step):
        raise AirTouchError(f"{place}: go needs to_m, distance_m or height_m")


def _check_numbers(step: Mapping[str, Any], place: str) -> None:
    """Raise AirTouchError for a value of a step that is no number, or one that nobody flies."""
    number(step, "height_m", place, above=0.0 if step["do"] == "take-off" else -math.inf, default=1.0)
    for key in ("time_s", "speed_mps", "spacing_m"):
        if key in step and number(step, key, place, above=0.0) >= MAX_FLIGHT_S:
            raise AirTouchError(f"{place}: {key} = {step[key]:g} is too large")
    if number(step, "every_s", place, 0.0, default=0.0) >= MAX_FLIGHT_S:
        raise AirTouchError(f"{place}: every_s = {step['every_s']:g} is too large")
    for key in ("pulse_mps", "distance_m", "direction_deg"):
        number(step, key, place, default=0.0)


def _run(pen: _Pen, kind: str, step: Mapping[str, Any], place: str) -> None:
    if kind == "wait":
        pen.motors = 0.0
        pen.move(pen.at, step["time_s"])
    elif kind == "take-off":
        pen.motors = 1.0
        _vertical(pen, step["height_m"], step.get("time_s", 2.0), place)
    elif kind == "hover":
        pen.move(pen.at, step["time_s"])
        if step.get("pulse_mps"):
            if pen.position or step.get("every_s", 0.0) < 0.1:
                raise AirTouchError(f"{place}: pulses need velocity control and every_s of 0.1 or more")
            period = round(step["every_s"] * RATE_HZ)
            pulses = np.arange(len(pen.rows[-1])) % period >= period - PULSE_ROWS
            pen.rows[-1][pulses, c.VX] += step["pulse_mps"] * math.cos(pen.yaw)
            pen.rows[-1][pulses, c.VY] += step["pulse_mps"] * math.sin(pen.yaw)
    elif kind == "go":
        _check_go(step, place)
        to = pen.at.copy()
        if "to_m" in step:
            to[:2] = number_list(step, "to_m", place, 2)
        elif "distance_m" in step:
            angle = math.radians(step.get("direction_deg", 0.0))
            to[:2] += step["distance_m"] * np.array([math.cos(angle), math.sin(angle)])
        to[2] = step.get("height_m", to[2])
        seconds = np.linalg.norm(to - pen.at) / step["speed_mps"]
        _check_duration(seconds, place)
        pen.move(to, seconds)
    elif kind == "zigzag":
        length, width = number_list(step, "size_m", place, 2, above=0.0)
        corner = pen.at.copy()
        _check_duration(width / step["spacing_m"] / RATE_HZ, place)  # a row or more for each line
        lines = int(width / step["spacing_m"] + 1e-9) + 1  # a whole number of them but for rounding is that number
        _check_duration(lines * length / step["speed_mps"] + width / step["speed_mps"], place)
        for line in range(lines):
            y = corner[1] + line * step["spacing_m"]
            for x in ((0.0, length) if line % 2 == 0 else (length, 0.0)):
                to = np.array([corner[0] + x, y, corner[2]])
                pen.move(to, np.linalg.norm(to - pen.at) / step["speed_mps"])
    else:
        _vertical(pen, pen.top(pen.at) - 0.1, step.get("time_s", 3.0), place)
        pen.motors = 0.0
        pen.move(pen.at, 0.5)


def _vertical(pen: _Pen, height_m: float, seconds: float, place: str) -> None:
    """Climb or descend to a height. Raises AirTouchError where that is too fast."""
    way = abs(height_m - pen.at[2])
    _check_speed(way / seconds, place, f"; give time_s of {way / MAX_SPEED_MPS:.1f} s or more")
    pen.move(np.array([pen.at[0], pen.at[1], height_m]), seconds)


def _check_path(pen: _Pen, first: int, place: str) -> None:
    rows = np.concatenate(pen.rows)[first:]
    if rows[0, c.MOTORS] == 0.0:
        raise AirTouchError(f"{place}: it has not taken off")
    struck = first_below(pen.world, rows[:, c.X:c.Z + 1])
    if struck != NONE:
        x, y, z = rows[struck, c.X:c.Z + 1]
        raise AirTouchError(f"{place}: at ({x:.2f}, {y:.2f}) m it would fly "
                            f"{z:.2f} m high through a surface {pen.top((x, y)):.2f} m high")


def _check_duration(seconds: float, place: str) -> None:
    """Raise AirTouchError for a step longer than MAX_FLIGHT_S, before its rows are made."""
    if seconds > MAX_FLIGHT_S:
        raise AirTouchError(f"{place}: takes {seconds:.0f} s, longer than {MAX_FLIGHT_S:g} s")
