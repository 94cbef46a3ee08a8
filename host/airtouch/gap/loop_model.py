"""Linear model of the attitude and height loops: what noise makes of the motor commands.

Two families of controller: `firmware`, the cascaded PID of crazyflie-firmware with its
documented gains, and `cascade`, any proportional cascade (rate, angle, velocity) whose
gains are found from flights. Commands are in newtons per motor.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d

from airtouch.gap.flight import PERIOD_S

DEGREES = 180.0 / np.pi
FOLDS = (0, 1, -1, 2, -2)  #: multiples of the log's rate that fall onto a frequency (500 Hz controller)
AXES = ("thrust", "roll", "pitch")
YAW_HZ = 1.0  #: usual bandwidth of a yaw loop, which AXES leave out
OUTER_S = 0.01  #: period of the firmware's position loop and of its flow readings


@dataclass(frozen=True)
class Controller:
    """Gains of one axis. roll, pitch: rate -> command (gain, N per rad/s), angle -> rate (angle, 1/s),

    velocity -> angle (velocity, rad per m/s). thrust: climb -> command (gain, N per m/s),
    height -> climb (angle, 1/s). Integrals are shares of their gain per second, derivative
    in s. period_s: of the controller; lowpass_hz: of its gyro, 0 for none.
    """

    gain: float
    angle: float
    velocity: float = 0.0
    derivative: float = 0.0
    integral: float = 0.0
    angle_integral: float = 0.0
    velocity_integral: float = 0.0
    period_s: float = PERIOD_S
    lowpass_hz: float = 0.0
    on_error: bool = False  #: derivative acts on the error, angle loop included


def newtons_per_pwm(row: Any) -> float:
    """Slope of a motor's thrust over its command in hover, N."""
    c0, c1, c2 = (float(c) for c in row["thrust_curve"])
    each = float(row["mass"]) * float(row["gravity"]) / (4.0 * float(np.mean(row["gain"])))
    return float(np.sqrt(max(c1 * c1 + 4.0 * c2 * (each - c0), 1e-30)))


def firmware(row: Any, axis: str) -> Controller:
    """crazyflie-firmware's gains (simulation.controller), whose commands are PWM."""
    slope = newtons_per_pwm(row)
    if axis == "thrust":
        gain = 25.0 * float(row["thrust_scale"]) * slope
        return Controller(gain, 2.0, integral=15.0 / 25.0, angle_integral=0.25)
    gain = 0.5 * 250.0 * DEGREES * float(row["rate_scale"]) * slope
    return Controller(gain, 6.0, 25.0 / DEGREES, 2.5 / 250.0, 500.0 / 250.0, 0.5, 1.0 / 25.0,
                      float(row["step"]), float(row["gyro_lowpass"]), float(row["derivative_on_error"]) > 0.5)


def spectra(c: Controller, row: Any, axis: str, f: np.ndarray) -> np.ndarray:
    """Power (sources, bins) of the command for noise of unit power at each source, aliases included.

    Sources, roll and pitch: white rate, white angle, velocity falling with the frequency,
    torque; thrust: white climb, climb falling with the frequency, its square, force.
    row: plant row of `simulation.flight.prepare`, effects in it.
    """
    return _with_aliases(_sources(c, row, axis, f), _aliases(c, row, axis, f))


def _aliases(c: Controller, row: Any, axis: str, f: np.ndarray) -> np.ndarray:
    """What of the first source's noise folds into the log, noise to command, complex (folds, bins)."""
    folds = FOLDS[1:] if c.period_s < 0.5 * PERIOD_S else ()
    f = np.maximum(np.abs(f + np.array(folds).reshape(-1, 1) / PERIOD_S), 0.05)
    s = 2j * np.pi * f
    plant, rate, angle, _, filtered, whole = _parts(c, row, axis, f, s)
    size = 1.0 / (1.0 + plant * whole)
    return rate * size if axis == "thrust" else -(rate + angle / s) * filtered * size


def _with_aliases(power: np.ndarray, aliases: np.ndarray) -> np.ndarray:
    for folded in aliases:
        power[0] += np.abs(folded) ** 2
    return power


def excess_phase(c: Controller, row: Any, axis: str) -> float:
    """Phase (rad) by which the loop lags more than half a turn where its gain last is 1; > 0: unstable."""
    f = np.geomspace(0.3, 45.0, 160)
    loop = _open_loop(c, row, axis, f, 2j * np.pi * f)
    turned, size = np.unwrap(np.angle(loop)), np.abs(loop)
    turned += -2.0 * np.pi * np.ceil(turned[0] / (2.0 * np.pi))
    last = np.flatnonzero(size > 1.0)
    return float(-np.pi - turned[last[-1]]) if len(last) else -np.pi


def sensitivity(controllers: Sequence[Controller], row: Any, f: np.ndarray) -> np.ndarray:
    """Share (bins, 3) of an outside roll, pitch, yaw torque that turns the vehicle in spite of the loop.

    controllers: of AXES. f: Hz (bins,).
    """
    f = np.maximum(f, 0.05)
    s = 2j * np.pi * f
    out = [1.0 / (1.0 + _open_loop(c, row, axis, f, s)) for c, axis in zip(controllers[1:], AXES[1:], strict=True)]
    return np.stack([*out, s / (s + 2.0 * np.pi * YAW_HZ)], axis=1)


def turning_per_command(c: Controller, row: Any, axis: str, strengths: np.ndarray, f: np.ndarray,
                        width: float = 0.0) -> np.ndarray:
    """Angular acceleration (..., bins) to be expected for a logged command, rad/s^2 per N: S_yu / S_uu of roll or pitch

    for noise of given strengths (..., sources); width: of neighbouring bins of f that are
    smoothed over, standard deviation.
    """
    logged, turned = _transfers(c, row, axis, np.maximum(f, 0.05))
    cross, aliases = turned * logged.conj(), _aliases(c, row, axis, f)
    for k, folded in zip(FOLDS[1:], aliases, strict=False):  # noise of the gyro folds into log and command alike
        cross[0] += _difference(f) * np.where(f + k / PERIOD_S < 0.0, folded, folded.conj())
    cross, power = strengths @ cross, strengths @ _with_aliases(np.abs(logged) ** 2, aliases)
    if width > 0.0:
        cross, power = (gaussian_filter1d(x, width, axis=-1, mode="nearest") for x in (cross, power))
    return cross / power


def _difference(f: np.ndarray) -> np.ndarray:
    """Of two samples of the log over their distance in time, at the middle between them, 1/s."""
    return 2j * np.sin(np.pi * f * PERIOD_S) / PERIOD_S


def torque_per_command(row: Any, axis: str, f: np.ndarray) -> np.ndarray:
    """Angular acceleration (bins,) that the motors make of a command, rad/s^2 per N."""
    s = 2j * np.pi * np.maximum(f, 0.05)
    return s * _parts(firmware(row, axis), row, axis, np.maximum(f, 0.05), s)[0]


def _parts(c: Controller, row: Any, axis: str, f: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, ...]:
    """Plant, and the controller's rate (climb), angle (height), velocity paths, its filter, and all together."""
    hold = np.sinc(f * c.period_s) * np.exp(-0.5 * s * c.period_s)
    motor = np.exp(-s * float(row["actuator_delay"])) * hold * 0.5 * (
        1.0 / (1.0 + s * float(row["motor_rise"])) + 1.0 / (1.0 + s * float(row["motor_fall"])))
    late = _delayed(s, float(row["sensor_delay"]), float(row["step"]) if c.lowpass_hz else 0.0)
    lift = 4.0 * float(np.mean(row["gain"]))
    if axis == "thrust":
        k = float(row["height_gain"])
        climb = k * c.gain * (1.0 + c.integral / s)
        height = climb * c.angle * k * (1.0 + c.angle_integral / s)
        return lift / float(row["mass"]) * motor / s, climb, height, 0.0 * s, late, (climb + height / s) * late
    i = AXES.index(axis) - 1
    arm = float(np.mean(np.abs(row["rotor_y" if i == 0 else "rotor_x"])))
    k = c.gain * float(row["rate_gain"])
    change = c.derivative * (1.0 - np.exp(-s * c.period_s)) / c.period_s
    rate = k * (1.0 + c.integral / s + change)
    angle = k * (1.0 + c.integral / s + (change if c.on_error else 0.0)) * c.angle * float(row["attitude_gain"])
    angle = angle * (1.0 + c.angle_integral / s)
    velocity = angle * c.velocity * float(row["position_gain"]) * (1.0 + c.velocity_integral / s)
    filtered = late / _butterworth(s, c.lowpass_hz)
    whole = (rate + angle / s) * filtered + velocity * float(row["gravity"]) / s ** 2 * late
    return lift * arm / float(row["inertia"][i]) * motor / s, rate, angle, velocity, filtered, whole


def _open_loop(c: Controller, row: Any, axis: str, f: np.ndarray, s: np.ndarray) -> np.ndarray:
    plant, *_, whole = _parts(c, row, axis, f, s)
    return plant * whole


def _sources(c: Controller, row: Any, axis: str, f: np.ndarray) -> np.ndarray:
    """Power (sources, bins) of the logged command for noise of unit power, without aliases."""
    f = np.maximum(f, 0.05)
    if axis == "thrust":
        s, low = 2j * np.pi * f, np.maximum(f, 0.3)
        plant, rate, angle, velocity, filtered, whole = _parts(c, row, axis, f, s)
        size = 1.0 / (1.0 + plant * whole)
        climbs = np.abs((rate + angle / s) * size) ** 2
        return np.array([np.abs(rate * size) ** 2, climbs / low ** 2, climbs / low ** 4,
                         np.abs(whole / s * size) ** 2])
    return np.abs(_transfers(c, row, axis, f)[0]) ** 2


def _transfers(c: Controller, row: Any, axis: str, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of roll or pitch, (sources, bins) each: noise to logged command, noise to measured angular acceleration."""
    s, low = 2j * np.pi * f, np.maximum(f, 0.3)
    plant, rate, angle, velocity, filtered, whole = _parts(c, row, axis, f, s)
    size = 1.0 / (1.0 + plant * whole)
    share = kicked = np.ones_like(s)
    if c.on_error:  # set-points of the outer loop come as steps; the log takes the sample on which they do
        share = 1.0 + c.integral / s + c.derivative * (1.0 - np.exp(-s * c.period_s)) / c.period_s
        kicked = 1.0 + c.integral / s + c.derivative * (1.0 - np.exp(-s * OUTER_S)) / c.period_s
    outer = kicked / share - plant * whole * size
    gyro, torque = -(rate + angle / s) * filtered * size, -whole / s * size
    paths = np.array([velocity / low, velocity / low ** 2, angle / low ** 2])
    seen = [] if c.lowpass_hz else [angle * size]
    logged = np.array([gyro, *seen, *(outer * paths), torque])
    turned = s * plant * np.array([gyro, *seen, *(size * paths), torque])
    turned[0] += _difference(f)
    turned[-1] += 1.0
    return logged, turned


def _delayed(s: np.ndarray, delay: float, step: float) -> np.ndarray:
    """A delay; between two steps the simulator (and this) draws a straight line, which smooths.

    Not below one step: there the smoothing alone would pass for lower gains.
    """
    if step <= 0.0 or delay < step:
        return np.exp(-s * delay)
    whole = np.floor(delay / step + 1e-9)
    part = max(delay / step - whole, 0.0)
    return np.exp(-s * whole * step) * (1.0 - part + part * np.exp(-s * step))


def _butterworth(s: np.ndarray, cutoff: float) -> np.ndarray | float:
    if cutoff <= 0.0:
        return 1.0
    x = s / (2.0 * np.pi * cutoff)
    return 1.0 + np.sqrt(2.0) * x + x * x
