"""The shipped image flies: its stabilizer, estimator and controllers closed-loop around the simulator's vehicle.

Every two milliseconds the board hands over the motors that it drives, and gets what its sensors read. Set-points,
voltage and parameters reach it as packets of its radio.
"""

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.kernels.app_core import EDGES
from airtouch.simulation import loop
from airtouch.simulation.firmware import setpoint
from airtouch.simulation.flight import choose
from airtouch.simulation.scenario import FlightPlan, Scenario, draw_flight
from airtouch.vehicle import Vehicle

from . import plant as at
from .board import FLY, Board
from .plant import Plant

BOOT_S = 4.0  #: on the floor before the mission begins: self-tests, calibration, and the estimator at rest
REST = 0.2  #: the IMU's noise there over that in flight; the firmware takes no bias from noise of 10 LSB and more
GYRO_LSB, ACC_LSB = np.deg2rad(4000.0 / 65536.0), 48.0 / 65536.0 * 9.81  #: of the BMI088 as the firmware sets it
NO_RANGE_MM = 8190  #: what a VL53L1 says where it sees nothing
RADIO_RAW, BATTERY_STATE, COMMANDER, STOP, HOVER = 0x00, 0x13, 7, 0, 5  #: syslink and CRTP
ARM = b"\x01\x01"  #: the supervisor's command that arms, which platforms with brushless motors wait for
ARM_S = 1.0  #: before the mission begins
#: CRTP port and channel of the supervisor; platforms that need no command
SUPERVISOR, SUPERVISOR_COMMAND, ARMS_ITSELF = 9, 1, ("cf2", "")
#: CRTP port and channel of parameters by name; types of the firmware
PARAM, BY_NAME, UINT8, FLOAT = 2, 3, 0x08, 0x06
#: log variables
MOTORS = tuple(f"motor.m{i}" for i in range(1, 5))
#: log variables of the estimate
ESTIMATE = tuple(f"stateEstimate.{name}" for name in ("x", "y", "z", "vx", "vy", "vz", "roll", "pitch", "yaw"))
#: log variables of the IMU
IMU = tuple(f"{sensor}.{axis}" for sensor in ("acc", "gyro") for axis in "xyz")
IMU_UNITS = np.repeat([9.81, np.deg2rad(1.0)], 3)  #: m/s^2 and rad/s in those of IMU
#: log variables of each report
WATCHED = (*MOTORS, *ESTIMATE, "range.zrange", "pm.vbat", "airtouch.steps", "airtouch.edges", "airtouch.edge",
           "airtouch.late", "airtouch.loadMax", "airtouch.health", "supervisor.info", *IMU)
#: first columns of EmulatedFlight.table; those that begin with TRUE are the simulator's
T, TRUE_X, MOTOR, X, DOWN, TOP, TRUE_VELOCITY, TRUE_ANGLES, ACC, GYRO, COLUMNS = 0, 1, 4, 8, 17, 18, 19, 22, 25, 28, 31


@dataclass
class EmulatedFlight:
    """A flight in emulation: rows at 100 Hz and what happened.

    table (rows, 31): t_s (mission), true x, y, z (m), four motors, the nine of ESTIMATE, down range (m), height of
    what is below it (m), true velocity (m/s), true roll, pitch and yaw (rad), acc (m/s^2) and gyro (rad/s) as logged.
    pwm: (n, 4) motors every 2 ms, from the first tick on. edges: (s of the mission, kind, true x). free_words: stack
    that each task never used.
    """

    table: np.ndarray = field(default_factory=lambda: np.zeros((0, COLUMNS)))
    pwm: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), np.uint16))
    edges: list[tuple[float, str, float]] = field(default_factory=list)
    latency_us: int = 0
    latencies_us: np.ndarray = field(default_factory=lambda: np.zeros(0, np.uint32))
    late: int = 0
    load_us: int = 0
    free_words: dict[str, int] = field(default_factory=dict)
    ending: str = "ok"
    console: str = ""


def crtp(port: int, channel: int, data: bytes) -> bytes:
    """A syslink packet from the radio."""
    return struct.pack("<BBB", RADIO_RAW, 1 + len(data), port << 4 | 3 << 2 | channel) + data


def set_parameter(name: str, value: float) -> bytes:
    """The packet that sets a parameter by its name: a byte for a whole number, else a float."""
    kind, raw = (UINT8, bytes([value])) if isinstance(value, int) else (FLOAT, struct.pack("<f", value))
    return crtp(PARAM, BY_NAME, b"\0" + name.replace(".", "\0").encode() + b"\0" + bytes([kind]) + raw)


def set_point_packet(row: np.ndarray) -> bytes:
    """The set-point packet of a mission's row: velocities about the drone's own heading, a height; or stop."""
    if row[setpoint.MOTORS] < 0.5:
        return crtp(COMMANDER, 0, bytes([STOP]))
    c, s = np.cos(row[setpoint.YAW]), np.sin(row[setpoint.YAW])
    ahead, left = c * row[setpoint.VX] + s * row[setpoint.VY], c * row[setpoint.VY] - s * row[setpoint.VX]
    return crtp(COMMANDER, 0, struct.pack("<Bffff", HOVER, ahead, left, 0.0, row[setpoint.Z]))


def radio_packets(setpoints: np.ndarray, volts: float, step: int, wait: int,
                  parameters: Mapping[str, float]) -> Iterator[bytes]:
    """What the radio's processor sends at a step of the log: the battery's voltage, half-way through the start the
    parameters, and from `wait` on the mission's set-points."""
    yield struct.pack("<BBBff", BATTERY_STATE, 9, 0, volts, 0.0)
    if step == wait // 2:
        yield from (set_parameter(name, value) for name, value in parameters.items())
    if step >= wait:
        yield set_point_packet(setpoints[(step - wait) // loop.LOG_STEPS])


def sensor_block(readings: np.ndarray, rest: np.ndarray) -> bytes:
    """Readings for the board's sensors, as bytes. rest (2,): parts of counts of the flow that are still owed."""
    gyro = np.clip(np.round(readings[at.GYRO:at.GYRO + 6] / GYRO_LSB), -32768, 32767).astype("<i2")
    acc = np.clip(np.round(readings[at.ACC:at.ACC + 6] / ACC_LSB), -32768, 32767).astype("<i2")
    down = readings[at.RANGE]
    rest += readings[at.FLOW:at.FLOW + 2]
    whole = np.round(rest)
    rest -= whole
    flow = np.array([-whole[1], -whole[0]]).astype("<i2")  # as flowdeck_v1v2.c turns the PMW3901's axes
    millimetres = NO_RANGE_MM if np.isnan(down) else min(int(round(1000.0 * down)), NO_RANGE_MM)
    return gyro.tobytes() + acc.tobytes() + struct.pack("<H", millimetres) + flow.tobytes()


class _Radio:
    """What reaches the board by radio: voltage and parameters, the command that arms, set-points."""

    def __init__(self, board: Board, plan: FlightPlan, wait: int, arms: bool, parameters: Mapping[str, float]) -> None:
        self._board, self._setpoints, self._wait, self._parameters = board, plan.setpoints, wait, parameters
        self._arm_step = wait - int(ARM_S / at.STEP_S) if arms else -1

    def send(self, step: int, volts: float) -> None:
        """The packets of a step of the log."""
        if step == self._arm_step:
            self._board.say("L", crtp(SUPERVISOR, SUPERVISOR_COMMAND, ARM))
        for packet in radio_packets(self._setpoints, volts, step, self._wait, self._parameters):
            self._board.say("L", packet)


def log_row(now_s: float, plant: Plant, values: Mapping[str, float]) -> list[float]:
    """A row of EmulatedFlight.table. values: of WATCHED."""
    return [now_s, *plant.place, *(values[name] for name in MOTORS), *(values[name] for name in ESTIMATE),
            values["range.zrange"] / 1000.0, plant.top, *plant.velocity, *plant.angles,
            *(IMU_UNITS * [values[name] for name in IMU])]


def fly(elf: Path, scenario: Scenario, vehicle: Vehicle, seed: int = 0, flight: int = 0, *, app: bool = True,
        whole_milliseconds: bool = False, parameters: Mapping[str, float] | None = None,
        blind_s: Sequence[tuple[float, float]] = ()) -> EmulatedFlight:
    """One flight of a scenario by the emulated firmware.

    app, whole_milliseconds: Board. parameters: set by radio before take-off. blind_s: seconds of the mission in which
    the down range sees nothing.
    """
    plan = draw_flight(scenario, seed, flight)
    plant = Plant(plan, vehicle, seed, flight, choose(plan))
    result, rows, pwm, latencies = EmulatedFlight(), [], [], []
    rest, wait, edges = np.zeros(2), int(BOOT_S / at.STEP_S), 0
    at_rest(plant, True)
    with Board(elf, FLY, WATCHED, app=app, whole_milliseconds=whole_milliseconds) as board:
        radio = _Radio(board, plan, wait, vehicle.platform not in ARMS_ITSELF, parameters or {})
        board.go()
        for step in range(wait + len(plan.setpoints) * loop.LOG_STEPS):
            values, now = board.values(board.hear("M")), (step - wait) * at.STEP_S
            motors = np.array([values[name] for name in MOTORS])
            pwm.append(motors)
            if step > wait:
                latencies.append(values["latency_us"])
            if step == wait:
                at_rest(plant, False)
            ending = plant.step(motors)
            if ending != loop.OK:
                result.ending = f"{loop.ENDINGS[ending]} after {now:.2f} s"
                break
            if any(begin <= now < end for begin, end in blind_s):
                plant.readings[at.RANGE] = np.nan
            board.say("I", sensor_block(plant.readings, rest))
            if step % loop.LOG_STEPS == 0:
                radio.send(step, plant.readings[at.VOLTS])
                rows.append(log_row(now, plant, values))
            if values["airtouch.edges"] > edges:
                edges = int(values["airtouch.edges"])
                result.edges.append((now, EDGES[int(values["airtouch.edge"])], float(plant.place[0])))
            board.go()
        result.late, result.load_us = int(values["airtouch.late"]), int(values["airtouch.loadMax"])
        if result.ending == "ok":
            board.hear("M")
            result.free_words = board.end()
        result.console = board.console
    result.table, result.pwm, result.latencies_us = np.array(rows), np.array(pwm, np.uint16), np.array(latencies)
    result.latency_us = int(result.latencies_us.max(initial=0))
    if "Self test passed!" not in result.console:
        raise AirTouchError("the firmware's self-test failed; the console said:\n" + result.console[-1000:])
    return result


def at_rest(plant: Plant, begins: bool) -> None:
    """Scale the IMU's noise down for the time on the floor, or back."""
    for name in ("gyro_rms", "acc_rms"):
        noise = plant.state["imu"][name]
        plant.state["imu"][name] = noise * REST if begins else noise / REST
