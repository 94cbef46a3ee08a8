"""Linear model of the attitude and height loops: their transfer functions.

The controllers are those of `gap.loop.controller`. Commands are in newtons per motor.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from airtouch.gap.loop.controller import AXES, Controller, firmware

OUTER_S = 0.01  #: period of the firmware's position loop and of its estimator's predictions
IMU_S = 0.001  #: between samples of the IMU
CROSSING_HZ = np.geomspace(0.3, 45.0, 160)  #: where a loop's gain may last be 1
#: what `loop_parts` gives
Parts = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def of_loop(row: Any, axis: str) -> tuple[float, ...]:
    """All that a plant row gives the loop of one axis beside its controller: rows alike in this have the same spectra.

    The controller itself, where it is the firmware's, is `firmware(row, axis)`.
    """
    lags = [float(row[name]) for name in ("actuator_delay", "motor_rise", "motor_fall", "sensor_delay")]
    gains = [mean_of_rotors(row["gain"]), *(float(row[name]) for name in (
        "height_gain", "rate_gain", "attitude_gain", "position_gain", "gravity", "mass"))]
    if axis == "thrust":
        return (*lags, *gains)
    i = AXES.index(axis) - 1
    return (*lags, *gains[:-1], arm_of(row, i), float(row["inertia"][i]))


def arm_of(row: Any, i: int) -> float:
    """Mean distance of the rotors from the axis of roll (0) or pitch (1), m."""
    return mean_of_rotors(np.abs(row["rotor_y" if i == 0 else "rotor_x"]))


def mean_of_rotors(values: np.ndarray) -> float:
    """Mean (4,); NumPy's own takes ten times as long."""
    a, b, c, d = values.tolist()
    return (a + b + c + d) / 4.0


def excess_phase(c: Controller, row: Any, axis: str) -> float:
    """Phase (rad) by which the loop lags more than half a turn where its gain last is 1; > 0: unstable."""
    loop = _open_loop(c, row, axis, CROSSING_HZ)
    phase, size = np.unwrap(np.angle(loop)), np.abs(loop)
    phase += -2.0 * np.pi * np.ceil(phase[0] / (2.0 * np.pi))
    last = np.flatnonzero(size > 1.0)
    return float(-np.pi - phase[last[-1]]) if len(last) else -np.pi


def torque_per_command(row: Any, axis: str, f: np.ndarray, c: Controller | None = None) -> np.ndarray:
    """Angular acceleration (bins,) that the motors make of a command, rad/s^2 per N. c: the firmware's by default."""
    f = np.maximum(f, 0.05)
    return 2j * np.pi * f * plant_of(firmware(row, axis) if c is None else c, row, axis, f)


def plant_of(c: Controller, row: Any, axis: str, f: np.ndarray) -> np.ndarray:
    """Command to measured rate (climb), complex (bins,)."""
    fixed = fixed_of(c, f)
    s = fixed.s
    motor = _delayed(float(row["actuator_delay"]), 0.0, f.shape, f.tobytes()) * fixed.hold * 0.5 * (
        1.0 / (1.0 + s * float(row["motor_rise"])) + 1.0 / (1.0 + s * float(row["motor_fall"])))
    lift = 4.0 * mean_of_rotors(row["gain"])
    if axis == "thrust":
        return lift / float(row["mass"]) * motor / s
    i = AXES.index(axis) - 1
    return lift * arm_of(row, i) / float(row["inertia"][i]) * motor / s


def loop_parts(c: Controller, row: Any, axis: str, f: np.ndarray) -> Parts:
    """Transfer functions at frequencies f, Hz, each complex and as long as f: plant, rate path, angle path, velocity
    path and the whole controller.

    A path is from the measured rate, through its integrals, to the command; on the height axis rate, angle and
    velocity are climb, height and its integral.
    """
    fixed = fixed_of(c, f)
    s = fixed.s
    plant = plant_of(c, row, axis, f)
    late = sensed_late(c, row, f)
    renewed = fixed.renewed
    if axis == "thrust":
        k = float(row["height_gain"])
        late = late * renewed / fixed.acc
        climb = k * c.gain * fixed.integral * late
        height = climb * c.angle * k * fixed.angle_integral / s
        return plant, climb, height, 0.0 * s, climb + height
    k = c.gain * float(row["rate_gain"])
    filtered = late / fixed.lowpass / fixed.chip
    rate = k * fixed.whole * filtered
    angle = k * (fixed.whole if c.on_error else fixed.integral) * c.angle * float(row["attitude_gain"])
    angle = angle * fixed.angle_integral
    velocity = angle * c.velocity * float(row["position_gain"]) * fixed.velocity_integral
    angle, velocity = angle * filtered * renewed / s, velocity * renewed * float(row["gravity"]) / fixed.s2 * late
    return plant, rate, angle, velocity, rate + angle + velocity


def sensed_late(c: Controller, row: Any, f: np.ndarray) -> np.ndarray:
    """The sensors' delay, complex (bins,)."""
    return _delayed(float(row["sensor_delay"]), IMU_S if c.lowpass_hz or c.acc_hz else 0.0, f.shape, f.tobytes())


class Fixed(NamedTuple):
    """The parts of the loop that neither gains nor vehicle change, at some frequencies: arrays of their shape, or 1.

    s: 2 pi i f; s2: its square; hold: of the motors' commands; renewed: of the estimator's attitude, velocity and
    height, which hold between two predictions; integral, angle_integral, velocity_integral: 1 and the integral of the
    error, in the three loops; whole: with the derivative, in the innermost; outer: differences over a run of the outer
    loop, 1/s; lowpass, chip, acc: by which the controller's low-pass, the gyro's own and that of the acceleration
    divide.
    """

    s: np.ndarray
    s2: np.ndarray
    hold: np.ndarray
    renewed: np.ndarray
    integral: np.ndarray
    angle_integral: np.ndarray
    velocity_integral: np.ndarray
    whole: np.ndarray
    outer: np.ndarray
    lowpass: np.ndarray | float
    chip: np.ndarray | float
    acc: np.ndarray | float


def fixed_of(c: Controller, f: np.ndarray) -> Fixed:
    """The parts of a controller's loop that no gain changes, at frequencies f (Hz); cached."""
    return _fixed_at(c.period_s, c.hold_s, (c.lowpass_hz, c.chip_hz, c.acc_hz),
                     (c.integral, c.angle_integral, c.velocity_integral, c.derivative), f.shape, f.tobytes())


@lru_cache(256)
def _fixed_at(period: float, hold: float, filters: tuple[float, float, float],
              shares: tuple[float, float, float, float], shape: tuple[int, ...], frequencies: bytes) -> Fixed:
    f = np.frombuffer(frequencies).reshape(shape)
    s = 2j * np.pi * f
    runs = round(hold / period) if filters[0] else 1
    renewed = sum(np.exp(-s * k * period) for k in range(runs)) / runs if runs > 1 else 1.0 + 0.0 * s
    lowpass, chip, acc = (butterworth(s, cutoff) for cutoff in filters)
    integral, angle_integral, velocity_integral = (1.0 + share / s for share in shares[:3])
    return Fixed(s, s ** 2, np.sinc(f * period) * np.exp(-0.5 * s * period),
                 renewed * np.exp(-0.5 * s * IMU_S) if hold else renewed, integral, angle_integral, velocity_integral,
                 integral + shares[3] * ((1.0 - np.exp(-s * period)) / period), (1.0 - np.exp(-s * OUTER_S)) / period,
                 lowpass, chip, acc)


def _open_loop(c: Controller, row: Any, axis: str, f: np.ndarray) -> np.ndarray:
    plant, *_, whole = loop_parts(c, row, axis, f)
    return plant * whole


@lru_cache(512)
def _delayed(delay: float, step: float, shape: tuple[int, ...], frequencies: bytes) -> np.ndarray:
    """A delay; between two steps the simulator (and this) draws a straight line, which smooths.

    Not below one step: there the smoothing alone would pass for lower gains.
    """
    s = 2j * np.pi * np.frombuffer(frequencies).reshape(shape)
    if step <= 0.0 or delay < step:
        return np.exp(-s * delay)
    whole = np.floor(delay / step + 1e-9)
    part = max(delay / step - whole, 0.0)
    return np.exp(-s * whole * step) * (1.0 - part + part * np.exp(-s * step))


def butterworth(s: np.ndarray, cutoff: float) -> np.ndarray | float:
    """By what a second-order low-pass at the IMU's rate divides at s = 2 pi i f; 1 for a cutoff (Hz) that passes all.

    As in `simulation.filters`: bilinear, so that it takes more than its analogue towards half of that rate.
    """
    if cutoff <= 0.0 or cutoff >= 0.49 / IMU_S:
        return 1.0
    x = 1j * np.tan(0.5 * IMU_S * s.imag) / np.tan(np.pi * cutoff * IMU_S)
    return 1.0 + np.sqrt(2.0) * x + x * x
