"""The samples at which the drone is in the air."""

import numpy as np

from airtouch.logs.flight_log import PWM, FlightLog
from airtouch.parameters import DEFAULT

AIRBORNE_RANGE_M = 0.10  #: m, down range above which the drone is in the air, for logs without PWM


def airborne(log: FlightLog) -> np.ndarray:
    """True where the drone is in the air, (n,) bool: mean PWM above `Parameters.arm_pwm`.

    A lost row is as the last one before it. Without PWM: from the first to the last sample with a down range (or
    height) above 0.10 m. Raises AirTouchError when the log has neither.
    """
    if log.has(*PWM):
        with np.errstate(invalid="ignore", over="ignore"):
            power = log.stack(PWM).mean(axis=1)
        last = np.maximum.accumulate(np.where(np.isfinite(power), np.arange(len(power)), 0))
        return power[last] > DEFAULT.arm_pwm
    high = log["z_m" if log.has("z_m") and not log.has("zrange_m") else "zrange_m"] > AIRBORNE_RANGE_M
    flying = np.zeros(len(log), dtype=bool)
    where = np.flatnonzero(high)
    if len(where):
        flying[where[0]:where[-1] + 1] = True
    return flying
