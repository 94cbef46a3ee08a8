"""Phases of a flight: in the air or not, and ground, take-off, hover, cruise, platform, landing."""

import numpy as np

from airtouch.logs.flight_log import PWM, FlightLog

AIRBORNE_PWM = 15000.0  #: mean PWM above which the drone is in the air
AIRBORNE_RANGE_M = 0.10  #: where no PWM is logged: down range that only a flying drone shows


def sample_period(log: FlightLog) -> float:
    """Seconds between samples: meta["sample_period_s"], else the clock's median step, else 0.01."""
    known = log.meta.get("sample_period_s")
    if isinstance(known, (int, float)) and np.isfinite(known) and known > 0:
        return float(known)
    if log.has("t_s") and len(log) > 1:
        with np.errstate(invalid="ignore", over="ignore"):
            steps = np.diff(log["t_s"])
        steps = steps[np.isfinite(steps) & (steps > 0)]
        if len(steps):
            return float(np.median(steps))
    return 0.01


def airborne(log: FlightLog) -> np.ndarray:
    """Whether the drone flies, bool (n,): mean PWM > 15000.

    Without PWM: from the first to the last sample with a down range (or height)
    above 0.10 m. Raises AirTouchError when the log has neither.
    """
    if log.has(*PWM):
        with np.errstate(invalid="ignore", over="ignore"):
            return log.stack(PWM).mean(axis=1) > AIRBORNE_PWM
    high = log["z_m" if log.has("z_m") and not log.has("zrange_m") else "zrange_m"] > AIRBORNE_RANGE_M
    flying = np.zeros(len(log), dtype=bool)
    where = np.flatnonzero(high)
    if len(where):
        flying[where[0]:where[-1] + 1] = True
    return flying
