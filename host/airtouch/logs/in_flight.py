"""The samples at which the drone is in the air."""

import numpy as np

from airtouch.logs.flight_log import PWM, FlightLog
from airtouch.parameters import DEFAULT

AIRBORNE_RANGE_M = 0.10  #: m, down range above which the drone is in the air, where the PWM does not tell


def airborne(log: FlightLog, arm_pwm: float = DEFAULT.arm_pwm) -> np.ndarray:
    """True where the drone is in the air, (n,) bool: mean PWM of the logged motors above `arm_pwm`.

    A lost row is as the last one before it. Without PWM, with a motor that was never logged, and where `flies_below`:
    from the first to the last sample with a down range (or height) above 0.10 m. Raises AirTouchError when the log has
    neither.
    """
    power = _mean_pwm(log)
    if power is not None and ((power > arm_pwm).any() or not flies_below(log, arm_pwm)):
        return power > arm_pwm
    high = log[height_column(log)] > AIRBORNE_RANGE_M
    flying = np.zeros(len(log), dtype=bool)
    where = np.flatnonzero(high if power is None else high & (power > 0.0))
    if len(where):
        flying[where[0]:where[-1] + 1] = True
    return flying


def flies_below(log: FlightLog, arm_pwm: float = DEFAULT.arm_pwm) -> bool:
    """True if the mean PWM never passes `arm_pwm`, and yet the motors run above 0.10 m: a light or strong vehicle."""
    power = _mean_pwm(log)
    if power is None or not log.has(height_column(log)) or (power > arm_pwm).any():
        return False
    return bool(((power > 0.0) & (log[height_column(log)] > AIRBORNE_RANGE_M)).any())


def flies_below_in_words(log: FlightLog, arm_pwm: float = DEFAULT.arm_pwm) -> list[str]:
    """A warning where `flies_below`, else none."""
    return [f"the mean PWM never passes {arm_pwm:g}: {height_column(log)} above {AIRBORNE_RANGE_M:g} m counts as "
            "flight"] if flies_below(log, arm_pwm) else []


def height_column(log: FlightLog) -> str:
    """The column with the height: `zrange_m`, or `z_m` where that alone holds a value."""
    return "z_m" if _logged(log, "z_m") and not _logged(log, "zrange_m") else "zrange_m"


def _mean_pwm(log: FlightLog) -> np.ndarray | None:
    """Mean PWM of the logged motors, (n,), a lost row as the last one before it; None where a motor was not logged."""
    if not all(_logged(log, name) for name in PWM):
        return None
    motors = log.stack(PWM)
    there = np.isfinite(motors)
    with np.errstate(invalid="ignore", over="ignore"):
        power = np.where(there, motors, 0.0).sum(axis=1) / np.maximum(there.sum(axis=1), 1)
    last = np.maximum.accumulate(np.where(there.any(axis=1), np.arange(len(power)), 0))
    return power[last]


def _logged(log: FlightLog, name: str) -> bool:
    """True for a column that is there and holds a value; in a log without samples, for one that is there."""
    return log.has(name) and (len(log) == 0 or bool(np.isfinite(log[name]).any()))
