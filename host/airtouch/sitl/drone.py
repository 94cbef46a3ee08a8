"""The virtual drone: simulator, commander, supervisor and app, one row of 10 ms at a time."""

import math
from collections.abc import Sequence

import numpy as np

from airtouch.simulation import loop
from airtouch.simulation.compiled import jit
from airtouch.simulation.effects import Active
from airtouch.simulation.firmware import kalman, setpoint
from airtouch.simulation.scenario import FlightPlan
from airtouch.simulation.sensors import log_row
from airtouch.simulation.stepper import Stepper
from airtouch.sitl.app import App
from airtouch.sitl.commander import PERIOD_S, Commander
from airtouch.sitl.planner import FLYING, LANDING
from airtouch.vehicle import Vehicle

TICK_MS = 10
IS_FLYING_S = 2.0  #: s after the motors have stopped in which the firmware still reports "flying"
LOW_V, LOW_AFTER_S = 3.2, 5.0  #: V, and s below it, after which the firmware reports a low battery
NEARLY_EMPTY = 0.05  #: fraction of the battery's charge after the fault `low-battery`
BATTERY, LOW_POWER = 0, 3  #: values of pm.state
PRE_FLIGHT, CRASHED, LOCKED = "ready", "crashed", "locked"


class Drone:
    """The drone. `step` flies 10 ms. The state behind the log variables is in its attributes.

    row (33,): the simulator's row. estimate (9,): roll, pitch, yaw, velocity, position.
    """

    def __init__(self, plan: FlightPlan, vehicle: Vehicle, seed: int, flight: int, active: Sequence[Active],
                 ai_deck: bool) -> None:
        self._stepper = Stepper(plan, vehicle, seed, flight, active)
        self._start = plan.setpoints[0].copy()
        self._start[setpoint.MOTORS] = 0.0
        self._table = np.zeros((1, log_row.COLUMNS))
        self._setpoint = np.zeros((1, setpoint.SETPOINT_SIZE))
        self.commander, self.app = Commander(), App(ai_deck, vehicle)
        self.ticks = 0
        self.row = self._table[0]
        self.setpoint = self._setpoint[0]
        self.state, self.emergency = PRE_FLIGHT, False
        self.messages: list[str] = []  #: lines for the console
        self.took_off_s: float | None = None
        self._thrust_s, self._low_s, self._drained = -math.inf, 0.0, False
        self._begin(self._start)
        self.step()

    @property
    def now_s(self) -> float:
        """Seconds since start."""
        return self.ticks * PERIOD_S

    @property
    def now_ms(self) -> int:
        """The clock of log packets, ms."""
        return self.ticks * TICK_MS

    @property
    def estimate(self) -> np.ndarray:
        """The estimate, (9,): roll, pitch, yaw (rad), velocity (m/s), position (m, height over the floor)."""
        firmware = self._stepper.state[0]["firmware"]
        return np.concatenate([firmware["angles"], firmware["estimate"]["velocity"], firmware["kalman"]["x"]])

    @property
    def is_flying(self) -> bool:
        """True while the firmware reports "flying": the motors turn, or stopped less than IS_FLYING_S ago."""
        return self.now_s - self._thrust_s < IS_FLYING_S

    @property
    def motors_on(self) -> bool:
        """True if the motors turn now."""
        return self.setpoint[setpoint.MOTORS] > 0.5

    @property
    def height_over_floor(self) -> float:
        """True height of the down range sensor over the floor, m."""
        return float(self.row[log_row.POSITION + 2])

    @property
    def low_battery(self) -> bool:
        """True in the firmware's state "low power"."""
        return self._low_s > LOW_AFTER_S

    def quaternion(self) -> tuple[float, float, float, float]:
        """The estimated attitude as a quaternion x, y, z, w."""
        (sr, cr), (sp, cp), (sy, cy) = ((math.sin(a / 2), math.cos(a / 2)) for a in self.estimate[:3])
        return (sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
                cr * cp * cy + sr * sp * sy)

    def info(self) -> int:
        """The value of supervisor.info. Its bit 10, high-level commander disabled, is never set."""
        planner, ready = self.commander.planner, self.state == PRE_FLIGHT and not self.emergency
        bits = [ready, ready, True, ready, self.is_flying and ready, self.state == CRASHED,
                self.state == LOCKED, self.state == CRASHED, planner.state in (FLYING, LANDING),
                planner.finished(self.now_s)]
        return sum(bool(bit) << i for i, bit in enumerate(bits))

    def stop(self) -> None:
        """Emergency stop: motors off until `restart`."""
        self.emergency = True

    def recover(self) -> bool:
        """Put the drone upright after a crash, at the same place. True if it can fly again."""
        if self.state == CRASHED:
            self.commander.reset()
            self.state = PRE_FLIGHT
        return self.state == PRE_FLIGHT

    def restart(self) -> None:
        """Restart, as by the drone's button: clears set-points, locks and crashes."""
        self.commander.reset()
        self.state, self.emergency = PRE_FLIGHT, False

    def start_over(self) -> None:
        """Put the drone on the ground at the start of the scenario's mission.

        The battery is as at first; after `drain` it stays nearly empty.
        """
        self.restart()
        self._stepper.begin(self._start)
        self._setpoint[0] = self._start
        self._stepper.fly(self._setpoint, self._table)
        self._thrust_s = -math.inf
        if self._drained:
            self.drain()

    def reset_estimate(self, x_m: float, y_m: float, z_m: float, yaw_rad: float) -> None:
        """Start the estimate anew at this place and heading, at rest and level: estimatorKalmanInit()."""
        _reset_estimate(self._stepper.plant, self._stepper.state, x_m, y_m, z_m, yaw_rad)

    def drain(self) -> None:
        """Make the battery nearly empty."""
        self._drained = True
        self._stepper.plant[0]["battery_strength"] = 1.0
        battery = self._stepper.state[0]["battery"]
        battery["charge"] = min(NEARLY_EMPTY, battery["charge"])

    def step(self) -> str:
        """Fly 10 ms. Returns the kind of the edge that the app reports; "none" without one."""
        self._setpoint[0] = self.commander.setpoint(self.now_s, self.estimate)
        if self.commander.timed_out and self.state == PRE_FLIGHT and self.is_flying:
            self.state = LOCKED
            self.messages.append("SUP: Locked, reboot required")
        if self.state != PRE_FLIGHT or self.emergency:
            self.commander.planner.stop()
            self.setpoint[setpoint.MOTORS] = 0.0
        ending, _ = self._stepper.fly(self._setpoint, self._table)
        if ending != loop.OK:
            self._end(ending)
        self.row[log_row.T] = self.now_s
        self.ticks += 1
        if self.motors_on:
            self._thrust_s = self.now_s
            if self.took_off_s is None:
                self.took_off_s = self.now_s
        self._low_s = self._low_s + PERIOD_S if self.row[log_row.VBAT] < LOW_V else 0.0
        acc, gyro = (self.row[first:first + 3] for first in (log_row.ACC_WORLD, log_row.GYRO))
        pwm = self.row[log_row.PWM:log_row.PWM + 4]
        edge = self.app.step(self.now_s, acc, gyro, pwm, float(self.row[log_row.VBAT]), self.quaternion())
        if edge != "none":
            self.messages.append(f"AIRTOUCH: Edge {int(self.app.read('edge'))}")
        return edge

    def _begin(self, row: np.ndarray) -> None:
        battery = self._stepper.state[0]["battery"]
        charge = battery["charge"].item()
        self._stepper.begin(row)
        if self.ticks > 0:
            battery["charge"] = charge

    def _end(self, ending: int) -> None:
        """End a flight that the simulator cannot continue; the drone lies where it came down."""
        place = self._start.copy()
        if ending in (loop.STRUCK, loop.UPSET) and np.isfinite(self.row).all():
            place[setpoint.X], place[setpoint.Y] = self.row[log_row.POSITION:log_row.POSITION + 2]
            place[setpoint.YAW] = self.row[log_row.ANGLES + 2]
        if ending != loop.STRUCK or self.motors_on:
            self.state = CRASHED
            self.messages.append("SUP: Crashed, recovery required")
        self.commander.reset()
        self._begin(place)
        self._setpoint[0] = place
        self._stepper.fly(self._setpoint, self._table)


@jit
def _reset_estimate(plants, states, x_m, y_m, z_m, yaw_rad):
    """Start the Kalman filter of a flight's state (1,) anew; its plant (1,) has the settings."""
    firmware = states[0].firmware
    q = firmware.quaternion
    q[0], q[1], q[2], q[3] = math.cos(0.5 * yaw_rad), 0.0, 0.0, math.sin(0.5 * yaw_rad)
    kalman.begin(plants[0].firmware, firmware.kalman, x_m, y_m, z_m, q)
    firmware.kalman.updated = 1
    kalman.finalize(firmware.kalman)
