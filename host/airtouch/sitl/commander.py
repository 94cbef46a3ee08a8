"""Selection of the set-point: high-level planner, low-level packets, or watchdog.

As in crazyflie-firmware 2026.08 (commander.c, crtp_commander_generic.c, crtp_commander_rpyt.c, supervisor.c).
A set-point is a row of the simulator (`simulation.firmware.setpoint`): mode, position, velocity, yaw and motors. Rates
in packets (yaw rate, climb rate) are integrated row by row.
"""

import math
import struct

import numpy as np

from airtouch.simulation.firmware import setpoint as c
from airtouch.sitl.planner import Planner

PERIOD_S = 0.01  #: of a set-point, s
LEVEL_OUT_S, SHUT_DOWN_S = 0.5, 2.0  #: s without a new set-point until the drone levels out, and until its motors stop
MOST_CLIMB_M = 0.5  #: m, largest distance of the integrated height set-point from the drone
MOST_TILT_DEG = 30.0  #: degrees, largest roll and pitch of a packet
LEAST_THRUST, MOST_THRUST = 1000, 60000  #: PWM, limits of a packet (crtp_commander_rpyt.c)
(STOP, OLD_VELOCITY, OLD_Z_DISTANCE, CPPM, ALT_HOLD, OLD_HOVER, FULL_STATE, POSITION, VELOCITY, Z_DISTANCE,
 HOVER, MANUAL) = range(12)
FOUR = struct.Struct("<ffff")
FULL_STATE_BYTES = 29  #: of a packet: kind, position, velocity, acceleration, attitude and rates; the position is used


class Commander:
    """The commander. `setpoint(t, ...)` returns the row to fly at t; call it once for each row of 10 ms."""

    def __init__(self) -> None:
        self.planner = Planner()
        self.low_level = False  #: True while set-point packets have priority over the high-level commander
        self.levelled = self.timed_out = False
        self.alt_hold = self.pos_hold = False
        self._kind, self._values, self._since = STOP, (0.0,) * 4, 0.0
        self._yaw = self._height = 0.0
        self._thrust_locked = True

    def reset(self) -> None:
        """Motors off; the state after start."""
        self.planner.stop()
        self.low_level = self.levelled = self.timed_out = False
        self._thrust_locked = True

    def relax(self) -> None:
        """End low-level control: the high-level commander may take over."""
        self.low_level = False

    def take_rpyt(self, data: bytes, t: float, estimate: np.ndarray) -> None:
        """Handle a packet of the old commander port: roll, pitch, yaw rate, thrust."""
        if len(data) < 14:
            return
        roll, pitch, yaw, thrust = struct.unpack_from("<fffH", data)
        if not self.low_level:
            self._thrust_locked = True
        if thrust == 0:
            self._thrust_locked = False
        climb = (thrust - 32767.0) / 32767.0
        if self.pos_hold and self.alt_hold:
            self._low_level(VELOCITY, (pitch / 30.0, roll / 30.0, climb, -yaw), t, estimate)
        elif self.alt_hold:
            self._low_level(ALT_HOLD, (roll, pitch, -yaw, climb), t, estimate)
        else:
            push = 0 if self._thrust_locked or thrust < LEAST_THRUST else min(thrust, MOST_THRUST)
            self._low_level(MANUAL, (roll, pitch, -yaw, float(push)), t, estimate)

    def take_generic(self, data: bytes, t: float, estimate: np.ndarray) -> None:
        """Handle a packet of the generic commander port. Kinds that the simulator cannot fly are ignored."""
        kind = data[0] if data else None
        if kind == STOP:
            self._low_level(STOP, (0.0,) * 4, t, estimate)
        elif kind == MANUAL and len(data) >= 16:
            roll, pitch, yaw_rate, thrust, rate = struct.unpack_from("<fffHB", data, 1)
            if not rate:  # 1: roll and pitch are angular rates, which the simulator cannot fly
                self._low_level(MANUAL, (roll, pitch, yaw_rate, float(thrust)), t, estimate)
        elif kind == FULL_STATE and len(data) >= FULL_STATE_BYTES:
            x, y, z = (v / 1000.0 for v in struct.unpack_from("<hhh", data, 1))
            self._low_level(POSITION, (x, y, z, math.degrees(estimate[2])), t, estimate)
        elif kind in (OLD_VELOCITY, OLD_Z_DISTANCE, OLD_HOVER, ALT_HOLD, POSITION, VELOCITY, Z_DISTANCE,
                      HOVER) and len(data) >= 17:
            values = FOUR.unpack_from(data, 1)
            if kind in (OLD_VELOCITY, OLD_Z_DISTANCE, OLD_HOVER):  # these have the opposite sign of the yaw rate
                at = 3 if kind == OLD_VELOCITY else 2
                values = tuple(-v if i == at else v for i, v in enumerate(values))
                kind = {OLD_VELOCITY: VELOCITY, OLD_Z_DISTANCE: Z_DISTANCE, OLD_HOVER: HOVER}[kind]
            self._low_level(kind, values, t, estimate)

    def _low_level(self, kind: int, values: tuple, t: float, estimate: np.ndarray) -> None:
        if not all(math.isfinite(v) and abs(v) < 1e6 for v in values):
            return
        if not self.low_level or self.timed_out:
            self._yaw, self._height = estimate[2], estimate[8]
        self.low_level, self.timed_out = True, False
        self.planner.stop()
        self._kind, self._values, self._since = kind, values, t

    def setpoint(self, t: float, estimate: np.ndarray) -> np.ndarray:
        """The row (8,) to fly at t. estimate (9,): roll, pitch, yaw, velocity, position."""
        row = np.zeros(c.SETPOINT_SIZE)
        row[c.X], row[c.Y], row[c.YAW] = estimate[6], estimate[7], estimate[2]
        self.levelled = False
        if self.low_level:
            self._low_level_row(row, t, estimate)
            return row
        goal = self.planner.goal(t)
        if goal is None:
            self.planner.tell(estimate[6:9], estimate[3:6], estimate[2])
            return row
        row[c.MODE], row[c.X:c.Z + 1], row[c.VX:c.VY + 1] = c.HOLD, goal.position, goal.velocity[:2]
        row[c.YAW], row[c.MOTORS] = goal.yaw, 1.0
        return row

    def _low_level_row(self, row: np.ndarray, t: float, estimate: np.ndarray) -> None:
        kind, (a, b, d, e) = self._kind, self._values
        if t - self._since > SHUT_DOWN_S and kind != STOP:
            self.timed_out = True
        if kind == STOP or self.timed_out:
            return
        row[c.MOTORS] = 1.0
        yaw_rate = 0.0 if kind == POSITION else e if kind == VELOCITY else d
        if t - self._since > LEVEL_OUT_S:
            self.levelled = True
            yaw_rate = 0.0
        self._yaw += math.radians(yaw_rate) * PERIOD_S
        climb = d if kind == VELOCITY else e if kind == ALT_HOLD else None
        if kind == POSITION:
            self._yaw, self._height = math.radians(e), d
        elif kind in (HOVER, Z_DISTANCE):
            self._height = e
        elif climb is not None:
            low, high = estimate[8] - MOST_CLIMB_M, estimate[8] + MOST_CLIMB_M
            self._height = min(max(self._height + climb * PERIOD_S, low), high)
        row[c.YAW], row[c.Z] = self._yaw, self._height
        if self.levelled:
            row[c.MODE], row[c.VX], row[c.VY] = c.TILT, 0.0, 0.0
            if kind == MANUAL:
                row[c.MODE], row[c.Z], row[c.MOTORS] = c.TILT_THRUST, e, float(e > 0.0)
        elif kind == POSITION:
            row[c.MODE], row[c.X], row[c.Y] = c.HOLD, a, b
        elif kind in (VELOCITY, HOVER):
            turn = estimate[2] if kind == HOVER else 0.0
            row[c.VX] = math.cos(turn) * a - math.sin(turn) * b
            row[c.VY] = math.sin(turn) * a + math.cos(turn) * b
        else:
            row[c.MODE] = c.TILT_THRUST if kind == MANUAL else c.TILT
            row[c.VX] = min(max(a, -MOST_TILT_DEG), MOST_TILT_DEG)
            row[c.VY] = min(max(-b, -MOST_TILT_DEG), MOST_TILT_DEG)  # the firmware's pitch is positive nose up
            if kind == MANUAL:
                row[c.Z] = min(max(e, 0.0), 65535.0)
                row[c.MOTORS] = float(e > 0.0)
