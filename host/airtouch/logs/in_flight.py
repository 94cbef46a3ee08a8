"""The samples at which the drone is in the air."""

import numpy as np

from airtouch.logs.flight_log import PWM, FlightLog
from airtouch.parameters import DEFAULT

AIRBORNE_RANGE_M = 0.10  #: m, down range above which the drone is in the air, for logs without PWM


def airborne(log: FlightLog) -> np.ndarray:
    """True where the drone is in the air, (n,) bool: mean PWM of the logged motors above `Parameters.arm_pwm`.

    A lost row is as the last one before it. Without PWM, or with a motor that was never logged: from the first to the
    last sample with a down range (or height) above 0.10 m. Raises AirTouchError when the log has neither.
    """
    if all(_logged(log, name) for name in PWM):
        motors = log.stack(PWM)
        there = np.isfinite(motors)
        with np.errstate(invalid="ignore", over="ignore"):
            power = np.where(there, motors, 0.0).sum(axis=1) / np.maximum(there.sum(axis=1), 1)
        last = np.maximum.accumulate(np.where(there.any(axis=1), np.arange(len(power)), 0))
        return power[last] > DEFAULT.arm_pwm
    high = log[height_column(log)] > AIRBORNE_RANGE_M
    flying = np.zeros(len(log), dtype=bool)
    where = np.flatnonzero(high)
    if len(where):
        flying[where[0]:where[-1] + 1] = True
    return flying


def height_column(log: FlightLog) -> str:
    """The column with the height: `zrange_m`, or `z_m` where that alone holds a value."""
    return "z_m" if _logged(log, "z_m") and not _logged(log, "zrange_m") else "zrange_m"


def _logged(log: FlightLog, name: str) -> bool:
    """True for a column that is there and holds a value; in a log without samples, for one that is there."""
    return log.has(name) and (len(log) == 0 or bool(np.isfinite(log[name]).any()))
