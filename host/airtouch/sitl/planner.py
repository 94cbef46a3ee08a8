"""The high-level commander: take-off, go-to, spiral and land along polynomials of 7th order.

As in crazyflie-firmware 2026.08 (planner.c, pptraj.c, crtp_commander_high_level.c): position,
velocity and acceleration are continuous at both ends, and the jerk is zero there. Positions in
m over the floor, yaw in rad, times in s of the drone's clock.
"""

import errno
import math
import struct
from dataclasses import dataclass

import numpy as np

SET_GROUP, TAKEOFF, LAND, STOP, GO_TO = 0, 1, 2, 3, 4
TAKEOFF_2, LAND_2, TAKEOFF_V, LAND_V, SPIRAL, GO_TO_2 = 7, 8, 9, 10, 11, 12
FORMATS = {SET_GROUP: "<B", TAKEOFF: "<Bff", LAND: "<Bff", STOP: "<B", GO_TO: "<BBfffff",
           TAKEOFF_2: "<Bff?f", LAND_2: "<Bff?f", TAKEOFF_V: "<Bf?f?f", LAND_V: "<Bf?f?f",
           SPIRAL: "<BBBfffff", GO_TO_2: "<BBBfffff"}
IDLE, FLYING, LANDING = "idle", "flying", "landing"
LEAST_DURATION_S = 0.05  #: s; a shorter time is taken as this one
#: value and derivatives of s^4 .. s^7 at s = 1, inverted
_ENDS = np.linalg.inv([[1.0, 1.0, 1.0, 1.0], [4.0, 5.0, 6.0, 7.0], [12.0, 20.0, 30.0, 42.0],
                       [24.0, 60.0, 120.0, 210.0]])


@dataclass(frozen=True)
class Goal:
    """A set-point: position, velocity, acceleration, (3,) each, in m, m/s, m/s²; yaw in rad and its rate in rad/s."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    yaw: float
    yaw_rate: float


def polynomial(seconds: float, start: tuple[float, float, float], end: tuple[float, float, float]) -> np.ndarray:
    """Coefficients (8,) of a polynomial in t / seconds, with zero jerk at both ends.

    start, end: value, first and second derivative there.
    """
    scale = np.array([1.0, seconds, seconds * seconds])
    p, v, a = np.asarray(start) * scale
    q, w, b = np.asarray(end) * scale
    half = 0.5 * a
    rest = np.array([q - p - v - half, w - v - a, b - a, 0.0])
    return np.concatenate([[p, v, half, 0.0], _ENDS @ rest])


def turn(yaw: float, to: float) -> float:
    """The angle `to` plus the multiple of 2 pi that brings it nearest to `yaw`, rad."""
    return yaw + (to - yaw + math.pi) % (2.0 * math.pi) - math.pi


class Planner:
    """The planner. `goal(t)` is the set-point at t; None while it is idle."""

    def __init__(self) -> None:
        self.state, self.group = IDLE, 0
        self.takeoff_mps, self.landing_mps = 0.5, 0.5
        self._begun, self._seconds, self._pieces = 0.0, 0.0, np.zeros((4, 8))
        self._last = Goal(np.zeros(3), np.zeros(3), np.zeros(3), 0.0, 0.0)

    def tell(self, position: np.ndarray, velocity: np.ndarray, yaw: float) -> None:
        """Set the drone's present state, from which the next trajectory starts if none is being flown."""
        self._last = Goal(np.array(position), np.array(velocity), np.zeros(3), yaw, 0.0)

    def stop(self) -> None:
        """Stop the motors, if the high-level commander has control."""
        self.state = IDLE

    def finished(self, t: float) -> bool:
        """True if the last trajectory has ended at time t."""
        return t >= self._begun + self._seconds

    def goal(self, t: float) -> Goal | None:
        """The set-point at t; None while idle. At the end of a landing the planner becomes idle."""
        if self.state not in (FLYING, LANDING):
            return None
        if self.state == LANDING and self.finished(t):
            self.state = IDLE
        self._last = self._at(t)
        return self._last

    def _at(self, t: float) -> Goal:
        s = min(max((t - self._begun) / self._seconds, 0.0), 1.0)
        moving = 0.0 if self.finished(t) else 1.0
        powers = s ** np.arange(8)
        value = self._pieces @ powers
        n = np.arange(1, 8)
        rate = self._pieces[:, 1:] @ (n * powers[:7]) / self._seconds * moving
        second = self._pieces[:, 2:] @ (n[1:] * n[:-1] * powers[:6]) / self._seconds**2 * moving
        return Goal(value[:3], rate[:3], second[:3], float(value[3]), float(rate[3]))

    def command(self, data: bytes, t: float) -> int:
        """Handle a packet of the high-level commander at time t. Returns 0 or the firmware's error code."""
        layout = FORMATS.get(data[0]) if data else None
        if layout is None or len(data) < 1 + struct.calcsize(layout):
            return errno.ENOEXEC
        group, *values = struct.unpack_from(layout, data, 1)
        if not all(math.isfinite(v) and abs(v) < 1e6 for v in values):
            return errno.EINVAL
        if data[0] == SET_GROUP:
            self.group = group
            return 0
        if group and not group & self.group:
            return 0
        if data[0] == STOP:
            self.stop()
            return 0
        if data[0] in (GO_TO, GO_TO_2):
            return self._go(t, *(values if data[0] == GO_TO_2 else [values[0], 0, *values[1:]]))
        if data[0] == SPIRAL:
            return self._spiral(t, *values)
        return self._vertical(data[0], t, values)

    def _plan(self, t: float, seconds: float, start: Goal, end: Goal, state: str) -> int:
        seconds = max(seconds, LEAST_DURATION_S)
        rows = [(start.position[i], start.velocity[i], start.acceleration[i]) for i in range(3)]
        ends = [(end.position[i], end.velocity[i], end.acceleration[i]) for i in range(3)]
        rows.append((start.yaw, start.yaw_rate, 0.0))
        ends.append((end.yaw, end.yaw_rate, 0.0))
        self._pieces = np.array([polynomial(seconds, a, b) for a, b in zip(rows, ends, strict=True)])
        self._begun, self._seconds, self.state = t, seconds, state
        return 0

    def _goal_at_rest(self, position: np.ndarray, yaw: float) -> Goal:
        return Goal(position, np.zeros(3), np.zeros(3), yaw, 0.0)

    def _vertical(self, kind: int, t: float, values: list) -> int:
        down = kind in (LAND, LAND_2, LAND_V)
        if self.state == LANDING if down else self.state != IDLE:
            return 1
        here = self._last
        height, yaw = values[0], 0.0
        if kind in (TAKEOFF, LAND):
            seconds = values[1]
        elif kind in (TAKEOFF_2, LAND_2):
            yaw, seconds = here.yaw if values[2] else values[1], values[3]
        else:
            if values[1]:
                height = here.position[2] + (-height if down else height)
            yaw = here.yaw if values[3] else values[2]
            speed = values[4] if values[4] > 0.0 else self.landing_mps if down else self.takeoff_mps
            seconds = abs(height - here.position[2]) / speed
        to = np.array([here.position[0], here.position[1], height])
        start, end = self._goal_at_rest(here.position, here.yaw), self._goal_at_rest(to, turn(here.yaw, yaw))
        return self._plan(t, seconds, start, end, LANDING if down else FLYING)

    def _go(self, t: float, relative: int, linear: int, x: float, y: float, z: float, yaw: float,
            seconds: float) -> int:
        start, to = self._last, np.array([x, y, z])
        if relative:
            to, yaw = to + start.position, yaw + start.yaw
        end = self._goal_at_rest(to, turn(start.yaw, yaw))
        if linear:
            seconds = max(seconds, LEAST_DURATION_S)
            speed, rate = (to - start.position) / seconds, (end.yaw - start.yaw) / seconds
            start = Goal(start.position, speed, np.zeros(3), start.yaw, rate)
            end = Goal(to, speed, np.zeros(3), end.yaw, rate)
        return self._plan(t, seconds, start, end, FLYING)

    def _spiral(self, t: float, sideways: int, clockwise: int, angle: float, r0: float, r1: float,
                ascent: float, seconds: float) -> int:
        """Plan an arc about a centre beside (or ahead of) the drone, from radius r0 to r1, in m."""
        seconds = max(seconds, LEAST_DURATION_S)
        angle, r0, r1 = min(max(angle, -2 * math.pi), 2 * math.pi), max(r0, 0.0), max(r1, 0.0)
        here, sense = self._last, 1.0 if clockwise else -1.0
        rate, growth = -sense * angle / seconds, (r1 - r0) / seconds
        ahead = 0.0 if sideways else math.pi / 2

        def around(yaw: float, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            """From the centre to the drone, its rate and second rate."""
            out = -sense * np.array([math.cos(yaw - ahead), math.sin(yaw - ahead), 0.0])
            along = np.array([-out[1], out[0], 0.0])
            return (radius * out, growth * out + radius * rate * along,
                    2 * growth * rate * along - radius * rate**2 * out)

        last_yaw, climb = here.yaw - sense * angle, np.array([0.0, 0.0, ascent])
        (p0, v0, a0), (p1, v1, a1) = around(here.yaw, r0), around(last_yaw, r1)
        start = Goal(here.position, v0 + climb / seconds, a0, here.yaw, rate)
        end = Goal(here.position - p0 + p1 + climb, v1 + climb / seconds, a1, last_yaw, rate)
        return self._plan(t, seconds, start, end, FLYING)
