"""The motor commands that noise makes: power spectra of the modelled loop, aliases included."""

from functools import lru_cache

import numpy as np

from airtouch.gap.flights.flight import PERIOD_S
from airtouch.gap.loop.axis_plant import AxisPlant
from airtouch.gap.loop.controller import Controller
from airtouch.gap.loop.loop_model import LOWEST_HZ, Fixed, Parts, fixed_of, loop_parts

FOLDS = (0, 1, -1, 2, -2)  #: multiples of the log's 100 Hz that fall onto a frequency: all of a 500 Hz controller
#: Hz, above which the estimated velocity's error falls by the frequency's square: errors of optical flow last
#: 0.1 s, and 1 / (2 pi 0.1 s) is 1.6; chosen.
FLOW_HZ = 1.5
WANDER_HZ = 0.3  #: below it errors that grow towards low frequency are flat, far below the commands' band; chosen


def noise_power(c: Controller, plant: AxisPlant, f: np.ndarray) -> np.ndarray:
    """Power (sources, bins) of the command for noise of unit power at each source, aliases included.

    Sources, roll and pitch: white rate; with the firmware's controller velocity flat up to FLOW_HZ and falling with
    the frequency's square beyond, with another one white angle and velocity falling with the frequency; velocity and
    angle falling with its square; torque. Thrust: white climb, climb falling with the frequency, its square, force,
    white error of the down range, the same drifting from reading to reading.
    """
    return with_aliases(_sources(c, plant, f), aliases_of(c, plant, f))


def aliases_of(c: Controller, plant: AxisPlant, f: np.ndarray) -> np.ndarray:
    """Transfer of the first source's noise, folded into the log, to the command, complex (folds, bins)."""
    if plant.axis == "thrust" or c.period_s >= 0.5 * PERIOD_S:
        return np.zeros((0, len(f)))
    beyond_hz = np.maximum(np.abs(f + np.array(FOLDS[1:])[:, None] / PERIOD_S), LOWEST_HZ)
    fixed = fixed_of(c, beyond_hz)
    to_rate, rate, angle, velocity, whole = loop_parts(c, plant, beyond_hz)
    kick = kick_of(c, fixed)
    rate_response = to_rate * -(rate + angle) / (1.0 + to_rate * whole)
    return -(rate + kick * angle) - (rate + kick * (angle + velocity)) * rate_response


def with_aliases(power: np.ndarray, aliases: np.ndarray) -> np.ndarray:
    """Power (sources, bins) with that of the first source's aliases (folds, bins) added to it in place."""
    for alias in aliases:
        power[0] += np.abs(alias) ** 2
    return power


def difference(f: np.ndarray) -> np.ndarray:
    """Transfer (bins,) of a difference of two samples of the log over their distance in time, at its middle, 1/s."""
    return 2j * np.sin(np.pi * f * PERIOD_S) / PERIOD_S


def _sources(c: Controller, plant: AxisPlant, f: np.ndarray) -> np.ndarray:
    """Power (sources, bins) of the logged command for noise of unit power, without aliases."""
    f = np.maximum(f, LOWEST_HZ)
    if plant.axis == "thrust":
        s, low = 2j * np.pi * f, np.maximum(f, WANDER_HZ)
        to_climb, climb, _, _, whole = loop_parts(c, plant, f)
        size = 1.0 / (1.0 + to_climb * whole)
        climbs = np.abs(whole * size) ** 2
        sources = [np.abs(climb * size) ** 2, climbs / low ** 2, climbs / low ** 4, np.abs(whole / s * size) ** 2]
        if c.range_gains[0]:
            sources += _range_errors(c, plant, f, size)
        return np.array(sources)
    return np.abs(transfers(c, plant, f, loop_parts(c, plant, f))[0]) ** 2


def transfers(c: Controller, plant: AxisPlant, f: np.ndarray, parts: Parts) -> tuple[np.ndarray, np.ndarray]:
    """Transfers of roll or pitch from noise to logged command and to measured angular acceleration.

    Each is complex (sources, bins).

    parts: of the loop at f.
    """
    fixed, low = fixed_of(c, f), np.maximum(f, WANDER_HZ)
    s = fixed.s
    to_rate, rate, angle, velocity, whole = parts
    size = 1.0 / (1.0 + to_rate * whole)
    kick = kick_of(c, fixed)
    tilt, speed = paths(c, plant, fixed)
    wandering = [speed / (low ** 2 + FLOW_HZ ** 2)] if c.lowpass_hz else [tilt, speed / low]
    outer = [*wandering, speed / low ** 2, tilt / low ** 2]
    direct = np.array([-(rate + angle), *outer, 0.0 * s])
    kicked = np.array([-(rate + kick * angle), *(kick * np.array(outer)), 0.0 * s])
    rate_response = to_rate * direct * size
    rate_response[-1] = size / s
    logged = kicked - (rate + kick * (angle + velocity)) * rate_response
    rate_response = s * rate_response
    rate_response[0] += difference(f) / fixed.chip
    return logged, rate_response


def paths(c: Controller, plant: AxisPlant, fixed: Fixed) -> tuple[np.ndarray, np.ndarray]:
    """Command (bins,) for an angle and for a velocity of 1 that the controller is asked for."""
    k = c.gain * plant.rate_gain
    tilt = k * fixed.integral * c.angle * plant.attitude_gain
    if c.on_error:
        tilt = tilt * fixed.whole / fixed.integral
    speed = tilt * c.velocity * plant.position_gain * fixed.velocity_integral
    return tilt * fixed.angle_integral, speed


def kick_of(c: Controller, fixed: Fixed, passed: float = 1.0) -> np.ndarray | float:
    """Ratio of the angle path in the log to that in the loop.

    Set-points of the outer loop and attitudes come as steps, whose derivative is in the log only where its rows are of
    the sample on which they step (c.kicked). passed: share of that sample's derivative that the command's limits leave.
    """
    if not c.on_error:
        return 1.0
    return (fixed.integral + c.kicked * passed * c.derivative * fixed.outer) / fixed.whole


def _range_errors(c: Controller, plant: AxisPlant, f: np.ndarray, size: np.ndarray) -> list[np.ndarray]:
    """Power (bins,) of the logged command for white errors of the down range, and for drifting ones; aliases in it.

    size: of the closed loop over the open one at f.
    """
    white, drifting = np.zeros(len(f)), np.zeros(len(f))
    for k in FOLDS:
        g = f + k / PERIOD_S
        power = np.abs(_ranged(c, plant, g) * (1.0 if k else size)) ** 2
        white += power
        drifting += power / (4.0 * np.sin(np.pi * g * c.range_s) ** 2 + (0.6 * np.pi * c.range_s) ** 2)
    return [white, drifting]


def _ranged(c: Controller, plant: AxisPlant, f: np.ndarray) -> np.ndarray:
    """Command for an error of the down range of 1 m at f (Hz), through the estimator's height and climb.

    Between two readings T apart the estimate moves on its own: X = (1 - (1 - K H) F / z)^-1 K.
    """
    s = 2j * np.pi * f
    height, climb = _estimated(*c.range_gains, c.range_s, f.tobytes())
    k = plant.height_gain
    gain = k * c.gain * (1.0 + c.integral / s)
    return np.sinc(f * c.range_s) * gain * (climb + c.angle * k * (1.0 + c.angle_integral / s) * height)


@lru_cache(64)
def _estimated(a: float, b: float, t: float, frequencies: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Height and climb (1/s) of the estimator, gains a and b, for an error of readings t apart, complex (bins,)."""
    z = np.exp(-2j * np.pi * np.frombuffer(frequencies) * t)
    # (1 - K H) F = [[1 - a, (1 - a) t], [-b, 1 - b t]]
    m00, m01, m10, m11 = 1.0 - z * (1.0 - a), -z * (1.0 - a) * t, z * b, 1.0 - z * (1.0 - b * t)
    det = m00 * m11 - m01 * m10
    return (m11 * a - m01 * b) / det, (m00 * b - m10 * a) / det
