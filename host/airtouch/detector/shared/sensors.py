"""Which sensors a log has, and what `best` gets where one is missing."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from airtouch.detector.shared.channels import level_acceleration
from airtouch.errors import unknown
from airtouch.logs.flight_log import ACC, ACC_WORLD, GYRO, PWM, FlightLog
from airtouch.logs.in_flight import AIRBORNE_RANGE_M, airborne
from airtouch.parameters import DEFAULT
from airtouch.reference.motion_channels import ACCELERATION, CHANNEL_TABLE, MOTORS, RATES, MotionConfig

SENSORS = (ACCELERATION, RATES, MOTORS)
#: motion channels that need each sensor, as indices of `reference.motion_channels.CHANNEL_TABLE`
CHANNELS_OF = {sensor: tuple(i for i, channel in enumerate(CHANNEL_TABLE) if sensor in channel.sensors)
               for sensor in SENSORS}

GRAVITY_MPS2 = 9.81  #: m/s^2, vertical acceleration in place of a missing one: that of rest
#: PWM in the air in place of missing motors. Chosen: any value above `arm_pwm` does, because their channels are silent
FLYING_PWM = 40000.0
#: rad/s, rms change of the rates from sample to sample over FLYING_WINDOW samples, above which the drone flies: of
#: 49,979 samples on the ground none reach 0.0127, of 431,415 in the air none fall below 0.0184 (the authors' flights).
FLYING_CHANGE_RADPS = 0.015
FLYING_WINDOW = 50  #: samples, half a second; chosen


@dataclass(frozen=True)
class Signals:
    """The kernels' inputs from a log of n samples.

    acc: (n, 3) m/s^2, level axes. gyro: (n, 3) rad/s. pwm: (n, 4). missing: sensors, of SENSORS, that the log lacks.
    """

    acc: np.ndarray
    gyro: np.ndarray
    pwm: np.ndarray
    missing: tuple[str, ...]


def required_columns(log: FlightLog, sensor: str) -> tuple[str, ...]:
    """Names of the columns of a sensor: accelerations in world axes where the log holds those, else in body axes."""
    acceleration = ACC_WORLD if log.has(*ACC_WORLD) else ACC
    return {ACCELERATION: acceleration, RATES: GYRO, MOTORS: PWM}[sensor]


def missing_sensors(log: FlightLog) -> tuple[str, ...]:
    """The sensors, of SENSORS, whose columns the log lacks."""
    return tuple(sensor for sensor in SENSORS if not log.has(*required_columns(log, sensor)))


def columns_missing_in_part(log: FlightLog, absent: Sequence[str]) -> list[str]:
    """The columns that the log lacks of those absent sensors, of SENSORS, of which it holds others."""
    parts = [required_columns(log, sensor) for sensor in absent]
    return [name for columns in parts if any(map(log.has, columns)) for name in columns if not log.has(name)]


def signals(log: FlightLog, rates_before: np.ndarray | Sequence = ()) -> Signals:
    """The log's signals, with rest or level flight in place of one missing sensor.

    rates_before: (k, 3) rates of the samples before, where the log is a piece of a flight; FLYING_WINDOW + 1 are
    enough. Raises AirTouchError, naming columns, where more than one sensor is missing.
    """
    absent = missing_sensors(log)
    if len(absent) > 1:
        log.require(*(name for sensor in absent for name in required_columns(log, sensor)))
    n = len(log)
    acc = np.tile([0.0, 0.0, GRAVITY_MPS2], (n, 1)) if ACCELERATION in absent else level_acceleration(log)
    gyro = np.zeros((n, 3)) if RATES in absent else log.stack(GYRO)
    if MOTORS in absent:
        rates = np.vstack([np.reshape(rates_before, (-1, 3)), gyro])
        pwm = FLYING_PWM * np.tile(is_flying(rates)[len(rates_before):, None], (1, 4))
    else:
        pwm = log.stack(PWM)
    return Signals(acc, gyro, pwm, absent)


def silent_in_all(flights: Sequence[FlightLog]) -> tuple[int, ...]:
    """Motion channels of the sensors that none of the flights has."""
    absent = set(SENSORS).intersection(*(missing_sensors(log) for log in flights)) if flights else set()
    return tuple(sorted({channel for sensor in absent for channel in CHANNELS_OF[sensor]}))


def silence(motion: MotionConfig, absent: tuple[str, ...]) -> MotionConfig:
    """The same settings with the channels of missing sensors held at 0: no bounds to their nominal amplitude."""
    silent = {channel for sensor in absent for channel in CHANNELS_OF[sensor]}
    return replace(motion, scale=tuple(np.inf if i in silent else s for i, s in enumerate(motion.scale)))


def without(log: FlightLog, sensors: tuple[str, ...]) -> FlightLog:
    """The log without the columns of these sensors. Raises AirTouchError for an unknown one."""
    columns = {ACCELERATION: (*ACC, *ACC_WORLD), RATES: GYRO, MOTORS: PWM}
    for sensor in sensors:
        if sensor not in columns:
            raise unknown("sensor", sensor, SENSORS)
    dropped = {name for sensor in sensors for name in columns[sensor]}
    return FlightLog({name: values for name, values in log.columns.items() if name not in dropped}, log.meta)


def airborne_by(log: FlightLog, arm_pwm: float = DEFAULT.arm_pwm) -> tuple[np.ndarray, str]:
    """True where the drone is in the air, (n,) bool, and what says so, for messages.

    By the motors, else by the down range or the height (`logs.airborne`), else by the rates (`is_flying`).
    arm_pwm: as of `airborne`. Raises AirTouchError, naming columns, for a log without any of them.
    """
    if log.has(*PWM):
        return airborne(log, arm_pwm), f"mean PWM above {arm_pwm:g}"
    heights = [name for name in ("zrange_m", "z_m") if log.has(name) and np.isfinite(log[name]).any()]
    if heights or not log.has(*GYRO):
        return airborne(log), f"a down range or height above {AIRBORNE_RANGE_M:g} m"
    return is_flying(log.stack(GYRO)), "rates that change as in flight; no motors in this log"


def is_flying(gyro: np.ndarray) -> np.ndarray:
    """Whether the drone flies, (n,) bool, from its rates (n, 3) rad/s alone; causal. The rotors shake it."""
    rates = np.nan_to_num(gyro)
    change = np.zeros(len(rates))
    change[1:] = np.square(np.diff(rates, axis=0)).sum(axis=1)
    total = np.cumsum(np.r_[0.0, change])
    first = np.maximum(np.arange(len(rates)) + 1 - FLYING_WINDOW, 0)
    mean = (total[1:] - total[first]) / FLYING_WINDOW
    return mean > FLYING_CHANGE_RADPS**2
