"""The motor commands that noise makes: power spectra of the modelled loop, aliases included.

The equations are in `gap.loop`.
"""

from functools import lru_cache

import numpy as np

from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.loop.axis_plant import AxisPlant
from airtouch.gap.loop.controller import Controller
from airtouch.gap.loop.loop_model import LOWEST_HZ, Factors, LoopParts, factors_of, loop_parts

FOLDS = (0, 1, -1, 2, -2)  #: multiples of the log's 100 Hz that fall onto a frequency: all of a 500 Hz controller
#: Hz, above which the estimated velocity's error falls by the frequency's square: errors of optical flow last
#: 0.1 s, and 1 / (2 pi 0.1 s) is 1.6; chosen.
FLOW_HZ = 1.5
WANDER_HZ = 0.3  #: below it errors that grow towards low frequency are flat, far below the commands' band; chosen


def noise_power(c: Controller, plant: AxisPlant, f: np.ndarray) -> np.ndarray:
    """Power (sources, bins) of the logged command for noise of unit power at each source, aliases included.

    Sources in roll and pitch, in this order, "f^-2" meaning an amplitude that falls so with frequency:

    - error of the rate, white; alone in what it folds into the log (`aliases_of`)
    - with the firmware's controller: error of the velocity, white up to FLOW_HZ and f^-2 beyond; with another one:
      error of the angle, white, and error of the velocity, f^-1
    - error of the velocity, f^-2; error of the angle, f^-2; torque, white

    Sources in thrust: error of the climb, white, f^-1 and f^-2; force, white; with the firmware's estimator errors of
    the down range, white and adding up from reading to reading.
    """
    at = np.maximum(f, LOWEST_HZ)
    parts = loop_parts(c, plant, at)
    if plant.axis == "thrust":
        return _power_in_thrust(c, plant, at, parts)
    return with_aliases(np.abs(transfers(c, plant, at, parts)[0]) ** 2, aliases_of(c, plant, f))


def _power_in_thrust(c: Controller, plant: AxisPlant, f: np.ndarray, parts: LoopParts) -> np.ndarray:
    """`noise_power` of the height loop, whose parts at f these are."""
    s, low = 2j * np.pi * f, np.maximum(f, WANDER_HZ)
    sensitivity = 1.0 / parts.return_difference
    of_climb = np.abs(parts.controller * sensitivity) ** 2
    sources = [np.abs(parts.rate * sensitivity) ** 2, of_climb / low ** 2, of_climb / low ** 4,
               np.abs(parts.controller / s * sensitivity) ** 2]
    if c.range_gains[0]:
        sources += _range_errors(c, plant, f, sensitivity)
    return np.array(sources)


def transfers(c: Controller, plant: AxisPlant, f: np.ndarray, parts: LoopParts) -> tuple[np.ndarray, np.ndarray]:
    """Transfers of roll or pitch from each noise to logged command and to measured angular acceleration.

    Each is complex (sources, bins), the sources as in `noise_power`; parts: of the loop at f. With d the path from a
    noise to the command, w = P d S and u_log = d_log - K_log w.
    """
    factors, low = factors_of(c, f), np.maximum(f, WANDER_HZ)
    s, kick = factors.s, kick_of(c, factors)
    of_angle, of_velocity = set_point_paths(c, plant, factors)
    flown = [of_velocity / (low ** 2 + FLOW_HZ ** 2)] if c.lowpass_hz else [of_angle, of_velocity / low]
    outer = [*flown, of_velocity / low ** 2, of_angle / low ** 2]
    sensitivity = 1.0 / parts.return_difference
    direct = np.array([-(parts.rate + parts.angle), *outer, 0.0 * s])
    direct_in_log = np.array([-(parts.rate + kick * parts.angle), *(kick * np.array(outer)), 0.0 * s])
    rate = parts.plant * direct * sensitivity
    rate[-1] = sensitivity / s  # a torque does not pass the motors
    logged = direct_in_log - parts.logged_controller(kick) * rate
    acceleration = s * rate
    acceleration[0] += difference(f) / factors.chip  # what the gyro errs by is measured too
    return logged, acceleration


def aliases_of(c: Controller, plant: AxisPlant, f: np.ndarray) -> np.ndarray:
    """Transfer of the rate's noise above half of the log's rate, folded into the log, to the command: (folds, bins).

    One row for each of FOLDS[1:], complex. None for a controller no faster than the log, or for thrust.
    """
    if plant.axis == "thrust" or c.period_s >= 0.5 * PERIOD_S:
        return np.zeros((0, len(f)))
    beyond_hz = np.maximum(np.abs(f + np.array(FOLDS[1:])[:, None] / PERIOD_S), LOWEST_HZ)
    parts, kick = loop_parts(c, plant, beyond_hz), kick_of(c, factors_of(c, beyond_hz))
    rate = parts.plant * -(parts.rate + parts.angle) / parts.return_difference
    return -(parts.rate + kick * parts.angle) - parts.logged_controller(kick) * rate


def with_aliases(power: np.ndarray, aliases: np.ndarray) -> np.ndarray:
    """Power (sources, bins) with that of the first source's aliases (folds, bins) added to it in place."""
    for alias in aliases:
        power[0] += np.abs(alias) ** 2
    return power


def difference(f: np.ndarray) -> np.ndarray:
    """Transfer (bins,) of a difference of two samples of the log over their distance in time, at its middle, 1/s."""
    return 2j * np.sin(np.pi * f * PERIOD_S) / PERIOD_S


def set_point_paths(c: Controller, plant: AxisPlant, factors: Factors) -> tuple[np.ndarray, np.ndarray]:
    """Command (bins,) for an angle (N/rad) and for a velocity (N per m/s) of 1 that the controller is asked for."""
    k = c.gain * plant.rate_gain
    angle = k * factors.integral * c.angle * plant.attitude_gain
    if c.on_error:
        angle = angle * factors.pid / factors.integral
    velocity = angle * c.velocity * plant.position_gain * factors.velocity_integral
    return angle * factors.angle_integral, velocity


def kick_of(c: Controller, factors: Factors, passed: float = 1.0) -> np.ndarray | float:
    """Ratio k of the angle path in the log to that in the loop, complex (bins,).

    Set-points of the outer loop and attitudes come as steps, whose derivative is in the log only where its rows are of
    the sample on which they step (c.kicked). passed: share of that sample's derivative that the command's limits leave.
    """
    if not c.on_error:
        return 1.0
    return (factors.integral + c.kicked * passed * c.derivative * factors.outer) / factors.pid


def _range_errors(c: Controller, plant: AxisPlant, f: np.ndarray, sensitivity: np.ndarray) -> list[np.ndarray]:
    """Power (bins,) of the logged command for white errors of the down range, and for drifting ones; aliases in it.

    sensitivity: S at f; what folds into the log is too fast for the loop. Errors that add up from reading to reading
    have the power 1 / (4 sin^2(pi f T)), flat below WANDER_HZ.
    """
    white, drifting = np.zeros(len(f)), np.zeros(len(f))
    for k in FOLDS:
        g = f + k / PERIOD_S
        power = np.abs(_command_per_range(c, plant, g) * (1.0 if k else sensitivity)) ** 2
        white += power
        drifting += power / (4.0 * np.sin(np.pi * g * c.range_s) ** 2 + (2.0 * np.pi * WANDER_HZ * c.range_s) ** 2)
    return [white, drifting]


def _command_per_range(c: Controller, plant: AxisPlant, f: np.ndarray) -> np.ndarray:
    """Command (bins,), N, for an error of the down range of 1 m, through the estimator's height and climb."""
    s = 2j * np.pi * f
    height, climb = _estimated(*c.range_gains, c.range_s, f.tobytes())
    k = plant.height_gain
    gain = k * c.gain * (1.0 + c.integral / s)
    return np.sinc(f * c.range_s) * gain * (climb + c.angle * k * (1.0 + c.angle_integral / s) * height)


@lru_cache(64)
def _estimated(a: float, b: float, t: float, frequencies: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Height and climb (1/s) of the estimator for an error of readings t (s) apart, complex (bins,).

    A steady Kalman filter of gains K = (a, b) moves the estimate between two readings by F = [[1, t], [0, 1]] and
    corrects it by H = (1, 0): X = (1 - (1 - K H) F / z)^-1 K, here by Cramer's rule.
    """
    z = np.exp(-2j * np.pi * np.frombuffer(frequencies) * t)  # 1 / z
    # (1 - K H) F = [[1 - a, (1 - a) t], [-b, 1 - b t]]
    m00, m01, m10, m11 = 1.0 - z * (1.0 - a), -z * (1.0 - a) * t, z * b, 1.0 - z * (1.0 - b * t)
    det = m00 * m11 - m01 * m10
    return (m11 * a - m01 * b) / det, (m00 * b - m10 * a) / det
