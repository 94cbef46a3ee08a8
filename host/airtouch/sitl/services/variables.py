"""The log variables and parameters of a Crazyflie 2.1 with Flow deck, Multi-ranger and AI-deck.

Names, types and units as in crazyflie-firmware 2026.08. Variables without a value in the simulator are absent.
"""

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from airtouch.simulation.body.battery import CHARGE, OPEN_CIRCUIT_V
from airtouch.simulation.firmware import setpoint
from airtouch.simulation.sensors import log_row
from airtouch.sitl import app
from airtouch.sitl.drone import BATTERY, LOW_POWER, Drone
from airtouch.sitl.services.log_service import CODES, hold
from airtouch.sitl.services.param_service import Parameter
from airtouch.sitl.services.toc import Item

G = 9.81
INVALID_RANGE_MM = 32767
RESET_ESTIMATE = "kalman.resetEstimation"  #: writing 1 resets the estimate; the firmware then clears it
INITIAL = ("kalman.initialX", "kalman.initialY", "kalman.initialZ", "kalman.initialYaw")  #: m and rad after a reset
START_OVER = "sitl.startOver"  #: parameter that only the virtual drone has: writing 1 puts it back to its start
GYRO_LSB_DEG = 2000.0 * 2.0 / 65536.0
Read = Callable[[Drone], float]
Variables = dict[str, tuple[str, Read]]


def compress(q: tuple[float, float, float, float]) -> int:
    """A unit quaternion x, y, z, w in Bitcraze's 32 bits; the inverse of logs.quaternion.decompress."""
    largest = max(range(4), key=lambda i: abs(q[i]))
    word = largest
    for i in range(4):
        if i != largest:
            magnitude = int(511 * abs(q[i]) * math.sqrt(2.0) + 0.5)
            word = word << 10 | ((q[i] < 0) != (q[largest] < 0)) << 9 | min(magnitude, 511)
    return word


def log_variables(drone: Drone) -> Variables:
    """The log variables: name -> (type, function that reads it)."""
    table: Variables = {}

    def add(group: str, names: str, kind: str, read: Callable[[Drone, int], float]) -> None:
        for i, name in enumerate(names.split()):
            table[f"{group}.{name}"] = (kind, partial(_read, read, i))

    add("acc", "x y z", "float", lambda d, i: d.row[log_row.ACC + i] / G)
    add("gyro", "x y z", "float", lambda d, i: math.degrees(d.row[log_row.GYRO + i]))
    add("gyro", "xRaw yRaw zRaw", "int16_t",
        lambda d, i: round(math.degrees(d.row[log_row.GYRO + i]) / GYRO_LSB_DEG))
    add("stateEstimate", "x y z", "float", lambda d, i: d.estimate[6 + i])
    add("stateEstimate", "vx vy vz", "float", lambda d, i: d.estimate[3 + i])
    add("stateEstimate", "ax ay az", "float", lambda d, i: d.row[log_row.ACC_WORLD + i] / G - (i == 2))
    add("stateEstimate", "roll pitch yaw", "float", lambda d, i: math.degrees((1, -1, 1)[i] * d.estimate[i]))
    add("stateEstimate", "qx qy qz qw", "float", lambda d, i: d.quaternion()[i])
    add("stateEstimateZ", "x y z", "int16_t", lambda d, i: 1000.0 * d.estimate[6 + i])
    add("stateEstimateZ", "vx vy vz", "int16_t", lambda d, i: 1000.0 * d.estimate[3 + i])
    add("stateEstimateZ", "ax ay az", "int16_t", lambda d, i: 1000.0 * d.row[log_row.ACC_WORLD + i])
    add("stateEstimateZ", "quat", "uint32_t", lambda d, i: compress(d.quaternion()))
    add("stateEstimateZ", "rateRoll ratePitch rateYaw", "int16_t",
        lambda d, i: 1000.0 * (1, -1, 1)[i] * d.row[log_row.GYRO + i])
    add("stabilizer", "roll pitch yaw", "float", lambda d, i: math.degrees((1, -1, 1)[i] * d.estimate[i]))
    add("stabilizer", "thrust", "float", lambda d, i: float(np.mean(d.row[log_row.PWM:log_row.PWM + 4])))
    add("ctrltarget", "x y z", "float", lambda d, i: d.setpoint[setpoint.X + i])
    add("ctrltarget", "vx vy", "float", lambda d, i: d.setpoint[setpoint.VX + i])
    add("kalman", "stateX stateY stateZ", "float", lambda d, i: d.estimate[6 + i])
    add("kalman", "varX varY varZ", "float", lambda d, i: 1e-4)
    add("kalman", "varPX varPY varPZ", "float", lambda d, i: 1e-3)
    add("motor", "m1 m2 m3 m4", "uint16_t", lambda d, i: d.row[log_row.PWM + i])
    add("motor", "m1req m2req m3req m4req", "int32_t", lambda d, i: d.row[log_row.PWM + i])
    add("range", "front back left right", "uint16_t", lambda d, i: _millimetres(d.row[log_row.WALLS + i]))
    add("range", "up", "uint16_t", lambda d, i: INVALID_RANGE_MM)
    add("range", "zrange", "uint16_t", lambda d, i: _millimetres(d.row[log_row.DOWN]))
    add("pm", "vbat", "float", lambda d, i: d.row[log_row.VBAT])
    add("pm", "vbatMV", "uint16_t", lambda d, i: 1000.0 * d.row[log_row.VBAT])
    add("pm", "state", "int8_t", lambda d, i: LOW_POWER if d.low_battery else BATTERY)
    add("pm", "batteryLevel", "uint8_t", lambda d, i: _level(d.row[log_row.VBAT]))
    add("supervisor", "info", "uint16_t", lambda d, i: d.info())
    add("sys", "canfly isFlying isTumbled", "uint8_t", lambda d, i: d.info() >> (3 + i) & 1)
    add("radio", "rssi", "uint8_t", lambda d, i: 40)
    add("radio", "isConnected", "uint8_t", lambda d, i: 1)
    for name, (kind, _, _) in app.LOGS.items():
        table[f"{app.GROUP}.{name}"] = (kind, partial(_of_app, name))
    return table


def _read(read: Callable[[Drone, int], float], element: int, drone: Drone) -> float:
    return read(drone, element)


def _of_app(name: str, drone: Drone) -> float:
    return drone.app.read(name)


def log_items(table: Variables) -> list[Item]:
    """The entries of the table of contents, with the variables of a group together."""
    groups = dict.fromkeys(name.split(".")[0] for name in table)
    named = {group: [name for name in table if name.startswith(group + ".")] for group in groups}
    return [Item(group, name.removeprefix(group + "."), CODES[table[name][0]]) for group in groups
            for name in named[group]]


def reader(table: Variables, items: list[Item], drone: Drone) -> Callable[[int], float]:
    """The function read(number) for the log service."""
    reads = [(table[item.complete_name][1], item.kind) for item in items]
    return lambda number: hold(reads[number][0](drone), reads[number][1])


def parameters(drone: Drone, ai_deck: bool) -> list[Parameter]:
    """The PARAM groups. Parameters without a meaning for the simulator can be set and read, without effect."""
    decks = dict.fromkeys(("bcFlow2", "bcMultiranger"), 1) | {"bcAI": int(ai_deck)} | dict.fromkeys(
        ("bcFlow", "bcZRanger", "bcZRanger2", "bcLighthouse4", "bcDWM1000", "bcLedRing", "bcUSD"), 0)
    return [
        *(Parameter(f"deck.{name}", "uint8_t", there, read_only=True, core=True)
          for name, there in decks.items()),
        Parameter("commander.enHighLevel", "uint8_t", 0, core=True),
        Parameter("hlCommander.vtoff", "float", 0.5, core=True),
        Parameter("hlCommander.vland", "float", 0.5, core=True),
        Parameter("hlCommander.groupmask", "uint8_t", 0, core=True),
        Parameter("flightmode.althold", "uint8_t", 0, core=True),
        Parameter("flightmode.poshold", "uint8_t", 0, core=True),
        Parameter("flightmode.stabModeRoll", "uint8_t", 1, core=True),
        Parameter("flightmode.stabModePitch", "uint8_t", 1, core=True),
        Parameter("flightmode.stabModeYaw", "uint8_t", 0, core=True),
        Parameter("stabilizer.estimator", "uint8_t", 2, core=True),
        Parameter("stabilizer.controller", "uint8_t", 1, core=True),
        Parameter("stabilizer.stop", "uint8_t", 0, core=True),
        Parameter(RESET_ESTIMATE, "uint8_t", 0, core=True),
        *(Parameter(name, "float", 0.0, core=True) for name in INITIAL),
        Parameter("pm.lowVoltage", "float", 3.2, persistent=True, core=True),
        Parameter("pm.criticalLowVoltage", "float", 3.0, persistent=True, core=True),
        Parameter("system.selftestPassed", "int8_t", 1, read_only=True),
        Parameter("firmware.revision0", "uint32_t", 0, read_only=True),
        Parameter("firmware.revision1", "uint16_t", 0, read_only=True),
        Parameter("firmware.modified", "uint8_t", 0, read_only=True),
        Parameter("crtpsrv.echoDelay", "uint16_t", 0),
        Parameter(START_OVER, "uint8_t", 0),
        *drone.app.parameters(),
    ]


def _millimetres(metres: float) -> float:
    return INVALID_RANGE_MM if not math.isfinite(metres) else round(1000.0 * metres)


def _level(volts: float) -> int:
    """Charge of a cell at this voltage, in percent, in steps of 10."""
    return int(10 * round(10 * float(np.interp(volts, OPEN_CIRCUIT_V, CHARGE))))
