"""A recorded flight through the firmware's real log variables: the app's every step beside the desktop's."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from airtouch import vehicle as vehicles
from airtouch.detector.shared.channels import level_acceleration
from airtouch.errors import AirTouchError
from airtouch.kernels.app_core import EDGES, AppCore
from airtouch.logs.flight_log import ATTITUDE, GYRO, PWM, FlightLog
from airtouch.sitl.app import LOGS, PARAMS

from .board import REPLAY, Board

VEHICLE = "crazyflie-2.1-flow"  #: that `make firmware` builds cf2 for
VEHICLES = {"cf2": VEHICLE, "cf21bl": "crazyflie-2.1-brushless"}  #: platform -> vehicle
GRAVITY, DEGREE = np.float32(9.81), np.float32(0.01745329252)  #: app_sensors.c
#: log variables that the app reads, in its order
FED = ("stateEstimate.ax", "stateEstimate.ay", "stateEstimate.az", "gyro.x", "gyro.y", "gyro.z", "motor.m1", "motor.m2",
       "motor.m3", "motor.m4", "pm.vbat", "stateEstimate.qx", "stateEstimate.qy", "stateEstimate.qz",
       "stateEstimate.qw")
TIMING = {"load", "loadMax", "late", "gap8Up"}  #: log variables that a desktop has no part in
APP_STACK_WORDS = 400  #: CONFIG_APP_STACKSIZE
TIMING_HEALTH = 128 | 256  #: late, stalled


@dataclass
class Replay:
    """What a replay gives: steps compared, those that differ with the first difference, edges (step, kind), and costs.

    prob_off: largest difference of `prob` over itself. It goes through the C library's expf, whose last bit is not that
    of the desktop's; everything else is compared to the bit.
    """

    steps: int = 0
    different: int = 0
    first: str = ""
    prob_off: float = 0.0
    edges: list[tuple[int, str]] = field(default_factory=list)
    late: int = 0
    longest_us: int = 0
    loads_us: list[int] = field(default_factory=list)
    stack_bytes: int = 0
    least_left: tuple[str, int] = ("", 0)  #: task whose stack has the fewest unused words, and how many
    console: str = ""


def rows(log: FlightLog) -> np.ndarray:
    """(n, 15) float32: what the log variables FED hold at each sample of a flight.

    A voltage or an attitude that was not logged is NaN and level. AirTouchError names columns that are missing.
    """
    missing = [name for name in (*GYRO, *PWM) if name not in log.columns]
    if missing:
        raise AirTouchError(f"{log.meta.get('source', 'the flight')} has no {', '.join(missing)}: the app needs "
                            "acceleration, "
                            "rates and motors; fly with the log configuration of host/docs/collect.md")
    acc, n = level_acceleration(log) / float(GRAVITY), len(log)
    acc[:, 2] -= 1.0
    attitude = np.tile([0.0, 0.0, 0.0, 1.0], (n, 1))
    if log.has(*ATTITUDE):
        (sr, sp, sy), (cr, cp, cy) = (f(0.5 * np.nan_to_num(log.stack(ATTITUDE)).T) for f in (np.sin, np.cos))
        attitude = np.column_stack([sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
                                    cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy])
    volts = log["vbat_V"] if log.has("vbat_V") else np.full(n, np.nan)
    pwm = np.clip(np.round(np.nan_to_num(log.stack(PWM))), 0, 65535)
    return np.column_stack([acc, log.stack(GYRO) / float(DEGREE), pwm, volts, attitude]).astype(np.float32)


def sample(row: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, np.ndarray]:
    """What app_sensors.c makes of a row, in its own arithmetic: acceleration, rates, PWM, voltage, attitude."""
    acc = GRAVITY * (row[:3] + np.array([0.0, 0.0, 1.0], np.float32))
    return acc, DEGREE * row[3:6], row[6:10], float(row[10]), row[11:15]


def desktop_values(core: AppCore) -> dict[str, float]:
    """Log variable -> value, of the core on the desktop."""
    values = {}
    for name, (_, at, element) in LOGS.items():
        value = getattr(core.log, at)
        values[name] = value if element < 0 else value[element]
    return values


def differs(name: str, board: float, desktop: float) -> bool:
    """Whether a log variable has other bits; any NaN is as good as another."""
    if name in TIMING:
        return False
    if name == "health":
        return (int(board) ^ int(desktop)) & ~TIMING_HEALTH != 0
    one, other = np.float64(board), np.float64(desktop)
    return one.tobytes() != other.tobytes() and not (np.isnan(one) and np.isnan(other))


def replay(elf: Path, log: FlightLog, steps: int | None = None,
           changes: Mapping[int, Mapping[str, float]] | None = None, vehicle: str = VEHICLE) -> Replay:
    """Fly a recorded flight through the emulated firmware, built for this vehicle.

    changes: step -> parameters of `airtouch` set before it.
    """
    table, changes = rows(log)[:steps], changes or {}
    names = [f"airtouch.{name}" for name in LOGS]
    core, result = AppCore(vehicle=vehicles.load(vehicle)), Replay()
    with Board(elf, REPLAY, names) as board:
        board.ask("W", FED)
        board.go()
        for step, row in enumerate(table):
            for name, value in changes.get(step, {}).items():
                board.parameter(f"airtouch.{name}", value)
                core.set_params(**{PARAMS[name]: float(np.float32(value))})
            board.say("V", row.tobytes())
            board.go()
            acc, gyro, pwm, volts, attitude = sample(row)
            kind = core.step(acc, gyro, pwm, vbat_v=volts, attitude=attitude)
            values = board.values(board.hear("S"))
            result.loads_us.append(int(values["airtouch.load"]))
            if kind != EDGES[0]:
                result.edges.append((step, kind))
            compare(result, step, values, desktop_values(core))
        result.late, result.longest_us = int(values["airtouch.late"]), int(values["airtouch.loadMax"])
        free_words = board.end()
        result.console = board.console
    result.stack_bytes, result.least_left = stack(free_words)
    return result


def stack(free_words: Mapping[str, int]) -> tuple[int, tuple[str, int]]:
    """Bytes of the app's stack in use, and the task with the fewest unused words, of what a board's end gives."""
    return 4 * (APP_STACK_WORDS - free_words["APP"]), min(free_words.items(), key=lambda item: item[1])


def compare(result: Replay, step: int, board: Mapping[str, float], desktop: Mapping[str, float]) -> None:
    """Count a step and what differs in it: log variables of the board (with their group) and of the desktop."""
    other = [name for name in LOGS if name != "prob" and differs(name, board[f"airtouch.{name}"], desktop[name])]
    one, two = float(board["airtouch.prob"]), float(desktop["prob"])
    if np.isnan(one) != np.isnan(two):
        other.append("prob")
    elif one != two:
        result.prob_off = max(result.prob_off, abs(one - two) / max(abs(one), abs(two)))
    result.steps += 1
    result.different += bool(other)
    if other and not result.first:
        result.first = f"step {step}: " + ", ".join(f"{n} {board[f'airtouch.{n}']} for {desktop[n]}" for n in other[:4])
